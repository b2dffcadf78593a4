"""Description files that start from a preset."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from somatopy.experiment import PRESETS, Description, Phase, load_description, paper

Read = Callable[[str], Description]
PAGE = (Path(__file__).parents[2] / "docs" / "description.md").read_text(encoding="utf-8")


@pytest.fixture
def read(tmp_path: Path) -> Read:
    def reading(text: str) -> Description:
        (tmp_path / "my.toml").write_text(text)
        return load_description(tmp_path / "my.toml")

    return reading


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_alone_is_that_preset(name: str, read: Read) -> None:
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
def test_what_a_file_says_replaces_what_the_preset_says(text: str, changes: dict[str, object], read: Read) -> None:
    """Tables join key by key; another kind begins with its own defaults, and a list is replaced as a whole."""
    assert read(f"preset = 'paper'\n{text}") == paper().replaced(**changes)


def test_the_page_of_the_format_is_whole(read: Read) -> None:
    """Its examples can be run, and its tables have every key."""
    examples = re.findall(r"```toml\n(.*?)```", PAGE, re.DOTALL)
    assert examples and all(read(example).frames for example in examples)
    keys = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.MULTILINE))
    assert keys == {*Description.model_fields, *Phase.model_fields, "preset", "start", "plastic", "damage"}
