"""Description files that start from a preset."""

from __future__ import annotations

from pathlib import Path

import pytest

from somatopy.experiment import PRESETS, Description, load_description, paper


@pytest.fixture
def read(tmp_path: Path):  # type: ignore[no-untyped-def]
    def reading(text: str) -> Description:
        (tmp_path / "my.toml").write_text(text)
        return load_description(tmp_path / "my.toml")

    return reading


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_alone_is_that_preset(name: str, read) -> None:  # type: ignore[no-untyped-def]
    """Nothing else said, nothing changed."""
    assert read(f"preset = '{name}'") == PRESETS[name]()


@pytest.mark.parametrize(
    ("text", "changes"),
    [
        ("seed = 3", {"seed": 3}),
        ("babbling.speed = 0.5", {"babbling": paper().babbling.replaced(speed=0.5)}),
        ("eye = 'geometric'", {"eye": "geometric"}),
        ("learner.kind = 'random'", {"learner": "random"}),
        ("learner.link_rate = 0.5", {"learner": paper().learner.replaced(link_rate=0.5)}),
        ("learner.arm_map.kind = 'som'", {"learner": paper().learner.replaced(arm_map={"kind": "som"})}),
        ("[[phases]]\nname = 'one'\nframes = 9", {"phases": [{"name": "one", "frames": 9}]}),
    ],
)
def test_what_a_file_says_replaces_what_the_preset_says(text: str, changes: dict[str, object], read) -> None:  # type: ignore[no-untyped-def]
    """Tables join key by key; another kind begins with its own defaults, and a list is replaced as a whole."""
    assert read(f"preset = 'paper'\n{text}") == paper().replaced(**changes)
