"""What `somatopy.study` takes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import somatopy
from somatopy.experiment import DescriptionError


@pytest.mark.parametrize(
    ("what", "said"),
    [
        ([somatopy.paper()], "A study is a file, a Study, or descriptions by the name of their condition, such as"),
        (somatopy.paper(), "A study is a file, a Study, or descriptions by the name"),
        ({3: somatopy.paper()}, "A study is a file, a Study, or descriptions by the name"),
        ({"a": "paper"}, "'a' must be a description, such as paper(), not 'paper'."),
        ({}, "The study 'study' has no conditions: give it at least one."),
    ],
)
def test_what_is_no_study(what: Any, said: str, tmp_path: Path) -> None:
    """One sentence, and nothing is written."""
    with pytest.raises(DescriptionError) as caught:
        somatopy.study(what, out=tmp_path / "s")
    assert str(caught.value).startswith(said)
    assert not (tmp_path / "s").exists()
