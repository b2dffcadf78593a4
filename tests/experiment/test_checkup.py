"""What is wrong with a robot; tests/cli/test_check_body.py has the models that are broken."""

from __future__ import annotations

from pathlib import Path

from somatopy.bodies import MODELS, Anatomy
from somatopy.experiment.checkup import checkup

NAO = MODELS["nao"].with_name("nao.xml")


def test_servos_that_stop_short_are_noted_and_stop_nothing(tmp_path: Path) -> None:
    """NAO whose arm is not held against gravity, its elbow's servo with a hundredth of its stiffness."""
    text = NAO.read_text().replace('gravcomp="1"', "").replace('kp="49.3"', 'kp=".2"').replace('kp="14.9"', 'kp=".2"')
    assert text.count('kp=".2"') == 2
    (tmp_path / "nao.xml").write_text(text)
    anatomy = Anatomy.load(MODELS["nao"])
    whole, weak = checkup(anatomy), checkup(anatomy.model_copy(update={"model": tmp_path / "nao.xml"}))
    assert whole.faults == () and whole.runs and weak.runs
    assert len(weak.faults) == 1 and "kp" in weak.faults[0].text and "came to rest far" in weak.faults[0].text
    assert weak.outlook is not None and whole.outlook is not None
    assert weak.outlook.rate == whole.outlook.rate  # what can be seen does not depend on servos
