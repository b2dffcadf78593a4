"""What is wrong with a robot, and that a robot with nothing wrong is told so."""

from __future__ import annotations

from pathlib import Path

import pytest

from somatopy.bodies import MODELS, Anatomy
from somatopy.bodies.survey import read_model, survey
from somatopy.experiment.checkup import checkup, model_faults

NAO = MODELS["nao"].with_name("nao.xml")


def nao(**tables: object) -> Anatomy:
    return Anatomy.model_validate(Anatomy.load(MODELS["nao"]).model_dump() | tables)


def test_servos_that_gravity_bends_are_noted(tmp_path: Path) -> None:
    """NAO without its compensation of gravity and with servos of a tenth of their stiffness; it can run all the same."""
    text = NAO.read_text().replace('gravcomp="1"', "")
    assert text.count('kp="') > 0
    (tmp_path / "nao.xml").write_text(text)
    spoiled = checkup(nao(model=tmp_path / "nao.xml"))
    assert spoiled.runs and spoiled.trial is not None
