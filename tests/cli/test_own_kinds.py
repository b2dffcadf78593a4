"""A part of one's own: one class in a module, registered by one line, is found wherever somatopy names parts."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from somatopy.analysis import load_run
from somatopy.cli import main
from somatopy.experiment import load_description
from somatopy.registry import INTERVENTIONS, LEARNERS, MAPS, Kinds

GAZE = '''
from somatopy.learners import FixedGaze

class Leaning(FixedGaze):
    """Looks a given way.

    Args:
        robot: its head is moved.
        rng: not used.
        yaw: angle of the head, rad.
        pitch: the other angle, rad.
    """

    def __init__(self, robot, rng, yaw: float, pitch: float = 0.1):
        super().__init__([yaw, pitch])
'''
MAP = '''
from somatopy.maps import SOM

class Lazy(SOM):
    """A self-organising map that learns at half the rate.

    Args:
        shape: units along each axis.
        learning_rate: how far a unit moves.
        width: as a SOM has it.
        horizon: as a SOM has it.
        lattice: as a SOM has it.
        periodic: as a SOM has it.
        laziness: what is left undone.
    """

    def __init__(self, shape=(6, 6), learning_rate=(0.5, 0.01), width=None, horizon=20_000, lattice="rectangular",
                 periodic=False, laziness: float = 0.5, bounds=(0, 1), init="uniform", dtype="float64",
                 missing="error", random_state=None):
        super().__init__(shape, learning_rate, width, horizon, lattice, periodic, bounds, init, dtype, missing,
                         random_state)
        self.laziness = laziness
'''
DAZE = '''
from somatopy.interventions import NoIntervention

class Dazed(NoIntervention):
    """The head goes only a part of each way.

    Args:
        part: which, of 1.
    """

    def __init__(self, part: float = 0.5):
        self._part = part

    def act(self, target, gaze, rng):
        return target, self._part * gaze
'''
PARTS: list[tuple[Kinds, str, str, str]] = [
    (LEARNERS, "leaning", "Leaning", GAZE),
    (MAPS, "lazy", "Lazy", MAP),
    (INTERVENTIONS, "dazed", "Dazed", DAZE),
]
QUICK = ["--eye", "geometric", "--motion", "kinematic", "--phases.0.frames", "20", "--phases.1.frames", "10"]
SMALL = ["--learner.arm-map.shape", "5", "5", "--learner.head-map.shape", "5", "5"]
LEANS = ["--learner", "leaning", "--learner.yaw", "0.4"]
Help = Callable[..., str]


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The three classes, each in a module of its own, each registered by one line."""
    monkeypatch.syspath_prepend(tmp_path)
    for kinds, name, attribute, source in PARTS:
        module = f"own_{name}_kind"
        (tmp_path / f"{module}.py").write_text(source)
        kinds.add(name, f"{module}:{attribute}")
    yield tmp_path
    for kinds, name, _, _ in PARTS:
        kinds.remove(name)


@pytest.fixture
def shown(capsys: pytest.CaptureFixture[str]) -> Help:
    """What --help shows of a table behind these options."""

    def call(table: str, *args: str) -> str:
        assert main(["run", "paper", *args, "--help", table]) == 0
        return " ".join(capsys.readouterr().out.replace("│", " ").replace("|", " ").split())

    return call


@pytest.mark.usefixtures("own")
def test_they_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    """By name, with the first line of what they say; an intervention is a damage, too."""
    assert main(["list", "--json"]) == 0
    table = json.loads(capsys.readouterr().out)
    assert table["learners"]["leaning"] == "Looks a given way."
    assert table["maps"]["lazy"] == "A self-organising map that learns at half the rate."
    assert table["interventions"]["dazed"] == table["damages"]["dazed"] == "The head goes only a part of each way."
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line for line in lines if line.startswith("  leaning ")] and max(map(len, lines)) <= 100


@pytest.mark.usefixtures("own")
def test_help_names_them_and_shows_their_fields(shown: Help) -> None:
    """Each name among its like; chosen, each argument with its meaning and default."""
    alone = shown("learner")
    assert "nearest, leaning" in alone and "grow-when-required, lazy" in alone
    assert "babbling-range, dazed" in shown("phases")
    learner = shown("learner", *LEANS)
    assert "--learner.pitch FLOAT The other angle, rad. (default: 0.1)" in learner
    assert "--learner.yaw FLOAT Angle of the head, rad. (default: 0.4)" in learner
    assert "--learner.arm-map.laziness FLOAT What is left undone. (default: 0.5)" in shown(
        "learner", "--learner.arm-map.kind", "lazy"
    )
    dazed = shown("phases", "--phases.0.damage", "dazed")
    assert "--phases.0.damage.part FLOAT Which, of 1. (default: 0.5)" in dazed


def ran(folder: Path, *args: str) -> Path:
    assert main(["run", *args, *QUICK, "--out", str(folder)]) == 0
    return folder


def test_flags_choose_and_set_them(own: Path) -> None:
    """A setting without a default, too; the run folder holds them, and it is what the run did."""
    folder = ran(own / "learner", "paper", *LEANS, "--phases.1.damage.kind", "dazed", "--phases.1.damage.part", "0.25")
    described = load_description(folder / "experiment.toml")
    assert (described.learner.kind, described.learner.yaw, described.learner.pitch) == ("leaning", 0.4, 0.1)
    assert described.phases[1].damage == "dazed"
    gaze = load_run(folder).postures("head", "command")
    assert np.allclose(gaze[1:20], [0.4, 0.1]) and np.allclose(gaze[21:], [0.1, 0.025])
    maps = ["--learner.arm-map.kind", "lazy", *SMALL, "--learner.arm-map.laziness", "0.25"]
    described = load_description(ran(own / "map", "paper", *maps) / "experiment.toml")
    arm_map = described.learner.arm_map
    assert (arm_map.kind, arm_map.shape, arm_map.laziness) == ("lazy", (5, 5), 0.25)


TOML = """
[learner]
kind = "hebbian"
arm_map = { kind = "lazy", laziness = 0.75 }
[[phases]]
name = "a"
[[phases]]
name = "b"
damage = "dazed"
interventions = [{ kind = "dazed", part = 0.5 }]
"""


def test_a_file_names_them(own: Path) -> None:
    """By their names in TOML, and by their places without any registration."""
    for name, text in (
        ("named", TOML),
        ("placed", TOML.replace('"lazy"', '"own_lazy_kind:Lazy"').replace('"dazed"', '"own_dazed_kind:Dazed"')),
    ):
        (own / f"{name}.toml").write_text(text)
        folder = ran(own / name, str(own / f"{name}.toml"), "--learner.head-map.shape", "5", "5")
        described = load_description(folder / "experiment.toml")
        assert described.learner.arm_map.laziness == 0.75
        assert described.phases[1].damage == "dazed+dazed"
        assert main(["resume", str(folder)]) == main(["evaluate", str(folder), "--postures", "3"]) == 0


def test_arguments_without_a_type_are_read_as_their_defaults_are(own: Path) -> None:
    """Numbers, texts and lists of them; what words cannot say keeps its value and is no option."""
    (own / "own_untyped.py").write_text(
        "def gaze(robot, rng, number=1, pair=(0.1, 2), text='a', switch=True, nothing=None, table={'a': [1]}):\n"
        "    from somatopy.learners import FixedGaze\n    return FixedGaze(pair)\n"
    )
    words = ["--learner", "own_untyped:gaze", "--learner.number", "3", "--learner.pair", "0.2", "-0.1"]
    words += ["--learner.text=b", "--learner.switch", "False", "--learner.nothing", "x"]
    settings = load_description(ran(own / "run", "paper", *words) / "experiment.toml").learner
    assert (settings.number, settings.pair, settings.text) == (3, (0.2, -0.1), "b")
    assert (settings.switch, settings.nothing, settings.table) == (False, "x", {"a": [1]})
    assert main(["run", "paper", *words, "--learner.table", "3"]) == 2


def test_what_lacks_or_does_not_fit_is_named(own: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A setting that must be given, one of another type, one that there is not, a place where nothing stands."""
    for args, words in (
        (["--learner", "leaning"], "learner.yaw: a value is missing"),
        (["--learner", "leaning", "--learner.yaw", "far"], "learner.yaw = 'far'"),
        ([*LEANS, "--learner.roll", "1"], "Valid ones: --learner.kind, --learner.yaw, --learner.pitch"),
        (["--learner", "own_leaning_kind:Leening"], "own_leaning_kind has no Leening; it has Leaning"),
        (["--learner", "no_such_module:Leaning"], "cannot be imported"),
    ):
        assert main(["run", "paper", *args, *QUICK, "--out", str(own / "none")]) == 2
        err = capsys.readouterr().err
        assert words in err and err.count("\n") == 1, err
        assert not (own / "none").exists()
