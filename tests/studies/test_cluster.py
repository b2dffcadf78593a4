"""Studies on a Ray cluster: two nodes, of which one is lost in mid-study; parts of one's own; what is refused."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

import somatopy
from somatopy.analysis.cells import COSTS, StudyResult, load_study
from somatopy.experiment import DescriptionError
from somatopy.studies import node, planned, study
from somatopy.studies.cluster import modules_for, on_cluster

HERE = Path(__file__).parent
LEARNER = """
import os
import signal
from typing import Annotated

from far.where import POSTURE
from somatopy.learners import FixedGaze
from typing_extensions import Doc


class Far(FixedGaze):
    def __init__(self, robot, rng, how: Annotated[str, Doc("How it ends.")] = "well"):
        super().__init__(POSTURE)
        self._how, self._left = how, 300

    def gaze(self, percept):
        self._left -= 1
        if self._left == 0 and self._how == "raises":
            raise ValueError("nothing left")
        if self._left == 0 and self._how == "crashes":
            os.kill(os.getpid(), signal.SIGSEGV)
        return super().gaze(percept)
"""


def loaded(path: Path) -> Any:
    """A file of ours as a module."""
    spec = spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    spec.loader.exec_module(module := module_from_spec(spec))
    return module


TWO_NODES, NAMESPACE = loaded(HERE / "two_nodes.py"), loaded(HERE.parent / "conftest.py").NAMESPACE


def write_own(folder: Path) -> Path:
    """A learner in a package, which imports a module beside it."""
    package = folder / "modules" / "far"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (package / "where.py").write_text("POSTURE = [0.1, 0.2]\n")
    (package / "gaze.py").write_text(LEARNER)
    return package


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> StudyResult:
    """The study as this machine runs it; what it compiles travels to the nodes with the sources."""
    return study(planned(TWO_NODES.COMPARED), out=tmp_path_factory.mktemp("here"), progress=False)


@pytest.fixture(scope="module")
def ran(tmp_path_factory: pytest.TempPathFactory, here: StudyResult) -> Path:
    """The folder in which both studies have run on two nodes."""
    folder = tmp_path_factory.mktemp("cluster")
    path = [str(Path(somatopy.__file__).parents[1]), str(write_own(folder).parent), *filter(None, sys.path)]
    done = subprocess.run(
        [*NAMESPACE, sys.executable, str(HERE / "two_nodes.py"), str(folder)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


def measured(result: StudyResult) -> list[dict[str, Any]]:
    """The rows of a table by key, without what they say of the computing."""
    rows = result.table.drop_columns([column.name for column in COSTS]).to_pylist()
    return sorted(rows, key=lambda row: (row["key"], row["phase"]))


@pytest.mark.cluster
def test_the_table_is_the_local_one_though_a_node_was_lost(ran: Path, here: StudyResult) -> None:
    """A node is lost while it runs a cell; the other one runs all that is left, and that cell again."""
    found = json.loads((ran / "found.json").read_text())
    assert found["lost"] and not {*found["lost"]} & {*found["ended before"]}
    there = load_study(ran / "compared")
    assert there.failures == [] and here.failures == []
    assert len({row["key"] for row in measured(there)}) == 8
    assert measured(there) == measured(here)


@pytest.mark.cluster
def test_own_code_travels_and_a_cell_that_fails_ends_no_other(ran: Path) -> None:
    """No node has the learner's package; what one cell raises and how another crashes is told."""
    result = load_study(ran / "own")
    assert result.conditions == ["well"]
    causes = {failure["condition"]: failure["cause"] for failure in result.failures}
    assert {*causes} == {"raises", "crashes"}
    assert causes["raises"].startswith("ValueError: nothing left. This came after ")
    assert causes["crashes"].startswith("its process was ended by SIGSEGV (")


@pytest.mark.cluster
def test_nothing_is_left_on_the_nodes(ran: Path) -> None:
    """Neither run folders nor logs, once a study has ended."""
    assert json.loads((ran / "found.json").read_text())["left"] == []


@pytest.mark.cluster
def test_where_no_ray_answers_it_is_said_at_once() -> None:
    """Not after the minute for which Ray itself would try."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    began = time.monotonic()
    with pytest.raises(DescriptionError, match=rf"No Ray cluster answers at 127.0.0.1:{port} \(.*refused"):
        study(planned({}), ray=f"127.0.0.1:{port}")
    assert time.monotonic() - began < 30


@pytest.mark.cluster
@pytest.mark.parametrize("address", ["somewhere", ":6379", "127.0.0.1:port"])
def test_what_is_no_address_is_refused(address: str) -> None:
    """With the three sorts of address that there are."""
    with pytest.raises(DescriptionError, match="is no address of a Ray cluster: auto, HOST:PORT or ray://HOST:PORT"):
        on_cluster(planned({}), address)


def test_without_ray_the_install_command_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """One sentence."""
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(DescriptionError, match=r'not installed: pip install "somatopy\[cluster\]"\.$'):
        on_cluster(planned({}), "auto")


def test_run_folders_cannot_be_kept_there() -> None:
    """They would stay on machines whose disks this one does not see."""
    with pytest.raises(DescriptionError, match=r"keep_frames = true .* without --ray"):
        on_cluster(planned({"keep_frames": True}), "auto")


def test_what_travels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """somatopy, and the whole package of a part; nothing else that is installed."""
    package, ours = write_own(tmp_path), Path(somatopy.__file__).parent
    monkeypatch.syspath_prepend(str(package.parent))
    assert modules_for(planned({})) == [ours]
    assert modules_for(planned(TWO_NODES.OWN)) == [ours, package]


def test_single_modules_travel_with_those_beside_them(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A file that a part imports from its own folder comes along; others that stand there do not."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "lonely_beside.py").write_text("POSTURE = [0.1, 0.2]\n")
    (tmp_path / "lonely_other.py").touch()
    (tmp_path / "lonely_gaze.py").write_text(LEARNER.replace("far.where", "lonely_beside"))
    plan = planned({"conditions": [{"name": "a", "learner": {"kind": "lonely_gaze:Far"}}]})
    assert {path.name for path in modules_for(plan)} == {"somatopy", "lonely_gaze.py", "lonely_beside.py"}


def test_a_machine_with_other_versions_runs_no_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its results would stand in the table under a key that says other versions."""
    monkeypatch.setattr(node, "_node", lambda: "a" * 20)
    rows, cause, where = node.run_cell([], "unused", {"numpy": "0.1"})
    assert rows is None and where == "a" * 20
    assert "numpy" in cause and "instead of 0.1; install the same versions there" in cause
