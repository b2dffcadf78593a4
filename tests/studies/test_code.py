"""Which code a cell depends on: told from the imports, held against what a run really loads and executes."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import somatopy
from somatopy.studies import code

PACKAGE = Path(somatopy.__file__).parent
#: Prints modules that a run of a description loaded and executed, and those that it should need.
TRACE = """
import json, sys
from somatopy.experiment.description import validated
from somatopy.api import run
given, out = json.loads(sys.argv[1]), sys.argv[2]
executed = set()
def note(frame, event, arg):
    if event == "call":
        executed.add(frame.f_globals.get("__name__"))
described = validated(given, "given")
sys.setprofile(note)
run(described, out, progress=False, maps=False)
sys.setprofile(None)
loaded = [*sys.modules]
from somatopy.studies.code import modules_of
needed = sorted(modules_of(described))
print(json.dumps({"executed": sorted(filter(None, executed)), "loaded": loaded, "needed": needed}))
"""
#: Edits files one after the other, and prints which of some descriptions have another digest then. It imports before.
EDITS = """
import json, sys
from pathlib import Path
import somatopy
from somatopy.experiment.description import validated
from somatopy.studies import code
home = Path(somatopy.__file__).parent
described = {name: validated(one, name) for name, one in json.loads(sys.argv[1]).items()}
def digests():
    for each in vars(code).values():
        if hasattr(each, "cache_clear"):
            each.cache_clear()
    return {name: code.code_digest(one) for name, one in described.items()}
before, found = digests(), []
for edits in json.loads(sys.argv[2]):
    for file, old, new in edits:
        text = (home / file).read_text(encoding="utf-8")
        assert old in text, file
        (home / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    now = digests()
    found.append([name for name in now if now[name] != before[name]])
    before = now
print(json.dumps(found))
"""


def said(script: str, *args: str, path: str) -> Any:
    done = subprocess.run(
        [sys.executable, "-c", script, *args],
        env={**os.environ, "PYTHONPATH": path},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def below_analysis(name: str) -> bool:
    first, _, behind = name.partition(".")
    return first == "somatopy" and behind.partition(".")[0] not in code._ABOVE


def test_all_that_a_run_executes_counts_and_nothing_that_it_does_not_load(described: Any, tmp_path: Path) -> None:
    """Modules that only gather names define no function that could be executed."""
    one = described(minutes=0.02, damage_minutes=0.02, motion="dynamic")
    found = said(TRACE, json.dumps(one.model_dump(mode="json")), str(tmp_path / "run"), path=str(PACKAGE.parent))
    assert {*found["needed"]} <= {*found["loaded"]}
    executed = {name for name in found["executed"] if below_analysis(name)}
    assert len(executed) > 30 and executed <= {*found["needed"]}


def test_edits_change_the_cells_that_need_the_module(described: Any, tmp_path: Path) -> None:
    """Docstrings and comments change none; the analysis none; a learner its own cells; session and robot all."""
    shutil.copytree(PACKAGE, tmp_path / "somatopy", ignore=shutil.ignore_patterns("__pycache__"))
    ones = {"hebbian": described(), "nearest": described(learner="nearest"), "random": described(learner="random")}
    future = "from __future__ import annotations\n"
    added = f"{future}added = 1\n"
    silent = [
        ("learners/nearest.py", '"""', '"""Said otherwise. '),
        ("experiment/session.py", future, f"{future}# A comment.\n"),
        ("analysis/cells.py", future, added),
    ]
    edits: list[tuple[Any, list[str]]] = [
        (silent, []),
        ([("learners/nearest.py", future, added)], ["nearest"]),
        ([("maps/dsom.py", future, added)], ["hebbian"]),
        ([("experiment/frame.py", future, added)], [*ones]),
        ([("bodies/nao/nao.xml", "<mujoco", "<!-- --><mujoco")], [*ones]),
    ]
    tables = json.dumps({name: one.model_dump(mode="json") for name, one in ones.items()})
    found = said(EDITS, tables, json.dumps([edit for edit, _ in edits]), path=str(tmp_path))
    assert found == [changed for _, changed in edits]


@pytest.mark.parametrize(
    ("folder", "counts"), [("site-packages", {"parts", "tools"}), ("scripts", {"parts", "tools", "beside"})]
)
def test_an_own_part_and_what_it_imports_from_beside_it_count(
    folder: str, counts: set[str], described: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not a module in its folder that it does not import, nor what else is installed where it is installed."""
    own, beside = f"own_in_{folder.partition('-')[0]}", f"beside_in_{folder.partition('-')[0]}"
    files = {
        f"{own}/__init__.py": "",
        f"{own}/parts.py": "import numpy\nfrom somatopy.learners.controls import RandomGaze\n"
        f"import {beside}\nfrom {own}.tools import x\n\n\nclass Own(RandomGaze):\n    pass\n",
        f"{own}/tools.py": "x = 1\n",
        f"{own}/unused.py": "",
        f"{beside}.py": "",
    }
    (tmp_path / folder / own).mkdir(parents=True)
    for name, text in files.items():
        (tmp_path / folder / name).write_text(text, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path / folder))
    found = code.modules_of(described(learner=f"{own}.parts:Own"))
    names = {
        name.rpartition(".")[2].removesuffix(f"_in_{folder}") for name in found if not name.startswith("somatopy.")
    }
    assert names == counts
