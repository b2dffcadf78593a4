"""somatopy study: many runs, from a file that says what is compared."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from somatopy.analysis.cells import CELLS, StudyResult
from somatopy.analysis.comparison import MEASURES, compare
from somatopy.analysis.comparison_table import text_table
from somatopy.analysis.relearning_table import relearning, relearning_text
from somatopy.cli.mirror import mark
from somatopy.cli.options import DEBUG, JSON, QUIET, SWITCH
from somatopy.cli.run import note
from somatopy.cli.words import read
from somatopy.experiment import Description, DescriptionError
from somatopy.studies.api import backend_for
from somatopy.studies.driver import perform
from somatopy.studies.estimate import estimate
from somatopy.studies.plan import Study
from somatopy.studies.reading import load_plan, planned
from somatopy.studies.recheck import recheck
from somatopy.studies.search import LOSSES_FILE, search, searched

__all__ = ["carry_out", "main"]

TEXT = """Run a study: conditions, each under many seeds, in processes of this machine or on a Ray cluster.

The file (TOML) says what is compared; docs/studies.md explains its keys. Without `eye` in it, all runs have the
geometric eye, a model of the detector that needs no pictures. The study folder holds one table, cells.parquet. The same
command with the same --out goes on where a study was stopped, and runs no finished cell again.

example: somatopy study speeds.toml --out speeds
"""
#: Measures that the table on standard output has.
TOLD = [measure for measure in MEASURES if measure.column in ("rate", "efficiency")]


@dataclass(frozen=True)
class StudyFlags:
    """Flags of the command."""

    file: Annotated[tyro.conf.Positional[Path], tyro.conf.arg(help="The study file.", metavar="FILE")]
    out: Annotated[Path | None, mark("FOLDER", "The study folder. (default: a new one in runs/)", None)] = None
    processes: Annotated[int | None, mark("N", "Processes of this machine. (default: one a core)", None)] = None
    ray: Annotated[str | None, mark("ADDRESS", "Run on the Ray cluster at this address.", None)] = None
    dry_run: Annotated[SWITCH, mark(None, "Say what time, memory and disk it needs; run nothing.", None)] = False
    check: Annotated[SWITCH, mark(None, "List cells that older code ran, and run some of them again.", None)] = False
    json: JSON = False
    quiet: QUIET = False
    debug: DEBUG = False


def main(args: Sequence[str]) -> int:
    """Run `somatopy study FILE [OPTIONS]`."""
    flags = read(StudyFlags, args, "somatopy study", TEXT)
    table = load_plan(flags.file)
    if "search" in table:
        return look_for(table, flags)
    study = planned(table)
    return check(study, flags) if flags.check else carry_out(study, flags)


def look_for(table: dict[str, Any], flags: StudyFlags) -> int:
    """Run a search, and print what came of it."""
    if flags.check or flags.dry_run:
        raise DescriptionError("A search proposes its cells as it goes: it has neither --check nor --dry-run.")
    result = search(searched(table), flags.out, ray=flags.ray, processes=flags.processes, progress=not flags.quiet)
    print(json.dumps(table_of(result)) if flags.json else result.path)
    say_failures(result)
    if not flags.quiet:
        note(f"Loss of each proposal: {result.path / LOSSES_FILE}")
    return 1 if result.failures else 0


def check(study: Study, flags: StudyFlags) -> int:
    """Say which cells of a study folder are stale, and whether some give the same when they run again."""
    if flags.out is None:
        raise DescriptionError("--check looks at a study folder: name it with --out.")
    found = recheck(study, flags.out, flags.processes)
    print(json.dumps(found.table()) if flags.json else found.text())
    return 0 if found.equal else 1


def carry_out(study: Study, flags: Any) -> int:
    """Run a study, or say what it would need, and print what came of it."""
    if flags.dry_run:
        found = estimate(study, flags.processes)
        print(json.dumps(found.table()) if flags.json else found.text())
        return 0
    if not flags.quiet:
        say_eye(study)
        say_damage(study)
    backend = backend_for(study, flags.ray)
    result = perform(study, flags.out, processes=flags.processes, backend=backend, progress=not flags.quiet)
    if flags.json:
        print(json.dumps(table_of(result)))
    else:
        table = relearning(result)
        print(relearning_text(table) if table else text_table(compare(result, measures=TOLD)))
    say_failures(result)
    if not flags.quiet:
        note(f"Table of all cells: {result.path / CELLS}. A page of them: somatopy report {result.path}")
    return 1 if result.failures else 0


def say_failures(result: StudyResult) -> None:
    """Say which cells failed, and why."""
    for failure in result.failures:
        note(f"failed: {failure['condition']}, seed {failure['seed']}: {failure['cause']}")


def say_eye(study: Study) -> None:
    """Say which eye a study has: a geometric one stands for the rendered one."""
    kinds = {condition.experiment.eye.kind for condition in study.conditions}
    if kinds == {"geometric"}:
        note(
            "Eye: geometric, a model of the detector. With --eye fiducial (eye in a study file) pictures are rendered."
        )


def say_damage(study: Study) -> None:
    """Say what stands for the paper's damage where a robot of the study is not the NAO."""
    if any(_is_stand_in(condition.experiment) for condition in study.conditions):
        note(
            "The paper's damage is that of a NAO's arm. On another arm each joint is felt shifted by the same share of "
            "its range."
        )


def _is_stand_in(experiment: Description) -> bool:
    """Whether the paper's damage is done to a robot that is not the NAO."""
    done = [settings for phase in experiment.phases for settings in phase.interventions]
    shifted = any(settings.kind == "offset" and getattr(settings, "offset", None) == "paper" for settings in done)
    return shifted and getattr(experiment.body, "model", None) != "nao"


def table_of(result: StudyResult) -> dict[str, Any]:
    """What --json prints: the rows, and what failed."""
    return {"folder": str(result.path), "cells": result.table.to_pylist(), "failures": result.failures}
