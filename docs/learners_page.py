"""The texts and tables of docs/learners.md, which docs/make_learners.py writes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from statistics import fmean
from typing import Any

from learners_cells import (
    BEST,
    FORK_SECOND,
    LAST,
    LATE,
    NAMES,
    PAPERS,
    SECOND,
    WIDE,
    BySeed,
    Cells,
    cells_of,
    column,
    ended,
    interval,
    listed,
    mean,
    of_seeds,
    rows,
    seeds,
    windows,
)
from somatopy.analysis.cells import StudyResult
from somatopy.analysis.relearning_table import relearning

TEMPLATE = Path(__file__).with_name("learners.template.md")
CALLED = {BEST: "`best`", PAPERS: "`hebbian`", "delta": "`delta`", "nearest": "`nearest`"}
RANGES = ("confined", WIDE, "mechanical")
#: Damages after which a posture that is felt no longer tells where the hand is.
DEAD = ("dead-joint-1", "dead-joint-2")
LOSING = (*DEAD, "noise")
#: Below this share of its own undamaged run a learner is lost.
LOST = 0.9
#: With fewer seeds nothing is called met or missed.
FEW = 3
#: Floor and goal in percent, by moment and range.
DEMANDS: dict[str, dict[str, tuple[int, int]]] = {
    "second five minutes": {"confined": (95, 97), WIDE: (91, 95), "mechanical": (83, 90)},
    "end of the hour": {"confined": (96, 98), WIDE: (93, 97), "mechanical": (88, 94)},
    "end of 197 minutes": {"confined": (96, 99), WIDE: (94, 97), "mechanical": (90, 96)},
    "second five minutes after a damage": {"confined": (97, 99), WIDE: (96, 98), "mechanical": (92, 97)},
}


def page(found: Mapping[str, StudyResult], measured: Mapping[str, Any]) -> str:
    """The whole page, as far as there are tables."""
    cells = {name: Cells(result) for name, result in found.items()}
    said: dict[str, Mapping[str, str]] = {
        "head": {"answer": answer(cells), "unfinished": unfinished(found)},
        "demands": {"table": demanded(cells)},
        "settings": {"table": elsewhere(cells)},
        "lost": {"text": never_lost(cells, measured)},
        "again": {"table": cost(found)},
    }
    if "learners" in cells:
        said["course"] = {"seeds": seeds([at_hour(cells, WIDE, BEST, SECOND)])}
    if "learners-damages" in cells:
        said["damages"] = damaged(cells["learners-damages"], measured)
    if "learners-moved" in found:
        said["moved"] = {"table": moved(found["learners-moved"])}
    if "learners-healed" in cells:
        said["retention"] = {"table": retained(cells["learners-healed"])}
    if any("grids" in one for one in measured.values()):
        said["error"] = {"table": error(measured)}
    if any("misses" in one for one in measured.values()):
        said["misses"] = missed(measured)
    parts = [text.format(**said[name]) for name, text in template().items() if name in said and text]
    return "\n\n".join(parts) + "\n"


def template() -> dict[str, str]:
    """The page's parts without their numbers."""
    texts = TEMPLATE.read_text(encoding="utf-8").split("<!-- part: ")[1:]
    return {name: text.strip() for name, _, text in (each.partition(" -->") for each in texts)}


def answer(cells: Mapping[str, Cells]) -> str:
    """The answer in three sentences."""
    main, damages = cells.get("learners"), cells.get("learners-damages")
    first = [[at_hour(cells, WIDE, learner, of) for of in (SECOND, LAST)] for learner in (BEST, PAPERS)]
    after = [main.values((WIDE, learner, "paper"), 1, FORK_SECOND) if main else {} for learner in (BEST, PAPERS)]
    kept = after_damages(damages, WIDE) if damages else {}
    others = "Other damages have not been run yet."
    if kept and damages:
        worst = min(kept, key=lambda damage: fmean(kept[damage].values()))
        few = "" if min(map(len, kept.values())) >= FEW else ", too few for a verdict"
        others = (
            f"After {len(kept)} kinds of damage that leave the information which a learner needs, `best` is at "
            f"{mean(over_damages(kept))} in the mean, and at {mean(kept[worst])} after the worst of them, "
            f"*{worst}*{of_seeds(kept.values())}{few}."
        )
    return (
        f"Where the hand can be seen, `best` sees it in {mean(first[0][0])} of the frames of its second five minutes "
        f"and in {mean(first[0][1])} at the end of an hour, and the paper's learner in {mean(first[1][0])} and "
        f"{mean(first[1][1])}{of_seeds([*first[0], *first[1]])}. "
        f"In the second five minutes after the paper's damage, `best` is at {mean(after[0])} of "
        f"what it reaches without damage, and the paper's learner at {mean(after[1])}"
        f"{of_seeds(after)}. {others}"
    )


def unfinished(found: Mapping[str, StudyResult]) -> str:
    """Which studies are not whole, in a sentence."""
    counts = {name: (ended(found[name]) if name in found else 0, cells_of(name)) for name in NAMES}
    some = [f"`{name}` ({there:,} of {of:,} cells)" for name, (there, of) in counts.items() if there < of]
    return f"\n**Not finished:** {listed(some)}. What stands here is from the cells that are there.\n" if some else ""


def at_hour(cells: Mapping[str, Cells], where: str, learner: str, of: Any) -> BySeed:
    """Efficiency in the undamaged hour with physics."""
    study = cells.get("learners" if where == WIDE else "learners-ranges")
    return study.values((where, learner, "none"), 0, of) if study else {}


def after_damages(study: Cells, where: str, learner: str = BEST) -> dict[str, BySeed]:
    """Share of the fork in the second window, percent, after each damage that leaves the information."""
    names = [damage for damage in study.damages(where, learner) if damage not in LOSING]
    found = {damage: study.values((where, learner, damage), 1, FORK_SECOND) for damage in names}
    return {damage: values for damage, values in found.items() if values}


def over_damages(kept: Mapping[str, BySeed]) -> BySeed:
    """Mean over damages, of each seed that has them all."""
    whole = set.intersection(*map(set, kept.values())) if kept else set()
    return {seed: fmean(values[seed] for values in kept.values()) for seed in sorted(whole)}


def demanded(cells: Mapping[str, Cells]) -> str:
    """The table of floors and goals."""
    second, hour, full, damage = DEMANDS
    body = []
    for where in RANGES:
        long = cells["learners-full"].values((where, BEST, "paper"), 0, LAST) if "learners-full" in cells else {}
        measured = ((second, SECOND), (hour, LAST))
        body += [line(where, moment, at_hour(cells, where, BEST, of), "yes") for moment, of in measured]
        body.append(line(where, full, long, "yes"))
        for name, physics in (("learners-damages", "yes"), ("learners-lost", "no")):
            kept = after_damages(cells[name], where) if name in cells else {}
            if kept:
                worst = min(kept, key=lambda each: fmean(kept[each].values()))
                body.append(line(where, damage, over_damages(kept), physics, f"mean of {len(kept)}"))
                body.append(line(where, damage, kept[worst], physics, f"worst: *{worst}*"))
    head = ("range", "moment", "over", "physics", "%, mean [95 % interval]", "floor", "goal", "verdict", "seeds")
    return rows(head, body)


def line(where: str, moment: str, values: BySeed, physics: str, which: str = "") -> list[str]:
    """A row of the table of floors and goals."""
    floor, goal = DEMANDS[moment][where]
    verdict = "not run yet"
    if 0 < len(values) < FEW:
        verdict = "too few seeds"
    elif values:
        reached = fmean(values.values())
        verdict = "goal met" if reached >= goal else "floor met" if reached >= floor else "**floor missed**"
    return [where, moment, which, physics, interval(values), f"{floor}", f"{goal}", verdict, f"{len(values)}"]


def damaged(study: Cells, measured: Mapping[str, Any]) -> dict[str, str]:
    """All damages and all learners: a short table, and the whole one."""
    learners = list(dict.fromkeys(learner for _, learner, _ in study.places))
    damages = list(dict.fromkeys(damage for _, _, damage in study.places if damage != "none"))
    body = []
    for damage in damages:
        every = [study.values((WIDE, learner, damage), 1, FORK_SECOND) for learner in learners]
        body.append([damage, *map(interval, every), seeds(every)])
    short = rows(["damage", *(CALLED.get(learner, learner) for learner in learners), "seeds"], body)
    return {"table": short, "whole": whole_table(study.result), "reference": reference(study, measured)}


def whole_table(result: StudyResult) -> str:
    """The table of `somatopy compare` in Markdown."""
    table = relearning(result)
    if table is None:
        return ""
    head = ["learner", "damage", *(f"{group}: {name}" for group, name in table.heads)]
    body = [
        [entry.learner, entry.damage, *(" ".join(filter(None, cell)) for cell in entry.cells)]
        for entry in table.entries
    ]
    return rows(head, body) + "\n\n" + " ".join(table.legend).replace("below it", "beside it")


def references(measured: Mapping[str, Any], where: str, damage: str) -> BySeed:
    """What a gaze without memory reaches, percent of the ceiling."""
    by_seed = measured.get(where, {}).get("references", {})
    return {int(seed): 100 * found[damage] for seed, found in by_seed.items()}


def reference(study: Cells, measured: Mapping[str, Any]) -> str:
    """Damages that take information away, beside what can be attained without it."""
    learners = list(dict.fromkeys(learner for _, learner, _ in study.places))
    body = []
    for damage in LOSING:
        bound = references(measured, WIDE, damage)
        every = [study.values((WIDE, learner, damage), 1, LATE) for learner in learners]
        attained = f"{fmean(bound.values()):.0f} ({len(bound)})" if bound else "not measured yet"
        body.append([damage, attained, *map(interval, every), seeds(every)])
    return rows(["damage", "without memory (seeds)", *(CALLED.get(each, each) for each in learners), "seeds"], body)


def moved(result: StudyResult) -> str:
    """The last three windows of each phase with the marker moved from the first frame on, or only by the damage."""
    body = []
    for name in result.conditions:
        every: list[BySeed] = [{}, {}]
        for row in result.table.to_pylist():
            reached = LAST(row) if row["condition"] == name and row["phase"] < 2 else None
            if reached is not None:
                every[row["phase"]][row["seed"]] = reached
        body.append([*name.split(": "), *map(interval, every), seeds(every)])
    return rows(("range", "the marker is", "end of the hour", "end of the half hour after it", "seeds"), body)


#: Study, range, what to call it, and how long its first phase is.
SETTINGS = (
    ("learners", WIDE, "paper-wide", "1 h"),
    ("learners-ranges", "mechanical", "mechanical", "1 h"),
    ("learners-ranges", "confined", "confined", "1 h"),
    ("learners-slow", WIDE, "slow head (preset `paper`)", "1 h"),
    ("learners-full", WIDE, "paper-wide", "197 min"),
    ("learners-full", "mechanical", "mechanical", "197 min"),
    ("learners-full", "confined", "confined", "197 min"),
    ("learners-rendered", WIDE, "paper-wide, rendered pictures", "1 h"),
)


def elsewhere(cells: Mapping[str, Cells]) -> str:
    """Ranges, the slow head, full length and rendered pictures."""
    body, missing = [], []
    for name, where, called, length in SETTINGS:
        for learner in (BEST, PAPERS) if name != "learners-rendered" else (BEST,):
            study, at = cells.get(name), (where, learner, "paper")
            moments = ((0, SECOND), (0, LAST), (1, windows(0, 1)), (1, SECOND), (1, LAST), (1, FORK_SECOND))
            every = [study.values(at, phase, of) if study else {} for phase, of in moments]
            if any(every):
                body.append([called, CALLED[learner], length, *map(interval, every), seeds(every)])
            else:
                missing.append(f"{called} ({CALLED[learner]}, {length})")
    before = ["setting", "learner", "before", "second window", "last three"]
    head = [*before, "after the damage: first", "second", "last three"]
    said = f"\n\nNot run yet: {listed(missing)}." if missing else ""
    return rows([*head, "second, % of the fork", "seeds"], body) + said


def never_lost(cells: Mapping[str, Cells], measured: Mapping[str, Any]) -> str:
    """Which cells are lost, by name."""
    said = []
    for name in ("learners-lost", "learners-damages"):
        if name not in cells:
            said.append(f"`{name}` has no cells yet.")
            continue
        shares = judged(cells[name], measured)
        lost = {place: below(those) for place, those in shares.items() if below(those)}
        physics = "with physics" if name == "learners-damages" else "without physics"
        count, looked = sum(map(len, lost.values())), sum(map(len, shares.values()))
        number = f"{count} is" if count == 1 else f"{count or 'none'} are"
        said.append(f"Of {looked:,} damaged runs of `best` in `{name}` ({physics}) {number} lost.")
        if lost:
            body = [
                [*place, f"{len(those)} of {len(shares[place])}", f"{fmean(shares[place].values()):.1f}", lowest(those)]
                for place, those in lost.items()
            ]
            said.append(rows(["range", "damage", "lost", "mean of all its runs, %", "lowest, % (seed)"], body))
    return "\n\n".join(said)


def judged(study: Cells, measured: Mapping[str, Any]) -> dict[tuple[str, str], BySeed]:
    """How each damaged run of the best learner ended, as far as that can be judged, by range and damage."""
    every = {
        (where, damage): late_shares(study, where, damage, measured)
        for where, learner, damage in study.places
        if learner == BEST and damage != "none"
    }
    return {place: shares for place, shares in every.items() if shares}


def below(shares: BySeed) -> BySeed:
    """Those seeds under which a run is lost."""
    return {seed: share for seed, share in shares.items() if share < 100 * LOST}


def lowest(shares: BySeed) -> str:
    """The lowest share, and its seed."""
    seed = min(shares, key=lambda each: shares[each])
    return f"{shares[seed]:.1f} ({seed})"


def late_shares(study: Cells, where: str, damage: str, measured: Mapping[str, Any]) -> BySeed:
    """Windows 4 to 6 as percent of the fork's; with a dead joint, of what can be attained without memory."""
    if damage not in DEAD:
        return study.values((where, BEST, damage), 1, column("fork_4_to_6", 100))
    bound = references(measured, where, damage)
    reached = study.values((where, BEST, damage), 1, LATE) if bound else {}
    return {seed: 100 * value / fmean(bound.values()) for seed, value in reached.items()}


def retained(study: Cells) -> str:
    """What is kept once a damage is undone."""
    body = []
    for where, learner, damage in study.places:
        kept = study.values((where, learner, damage), 2, column("retention", 100))
        minutes = study.values((where, learner, damage), 2, column("retention_minutes"))
        back = interval(minutes) if len(minutes) == len(kept) else f"{len(kept) - len(minutes)} of {len(kept)} never"
        soon = sum(value <= 1 for value in minutes.values())
        body.append([CALLED[learner], damage, interval(kept), back, f"{soon} of {len(kept)}", f"{len(kept)}"])
    return rows(["learner", "damage undone", "first minute, %", "minutes to 95 %", "within one", "seeds"], body)


def error(measured: Mapping[str, Any]) -> str:
    """What a finer grid adds to the ceiling."""
    body = []
    for where, found in measured.items():
        if grid := found.get("grids"):
            coarse, finer = 100 * grid["ceiling"], 100 * grid["ceiling_finer"]
            lacking = f"{100 * (finer - coarse) / coarse:.2f}"
            body.append([where, f"{coarse:.2f}", f"{finer:.2f}", lacking, f"{100 * grid['slivers']:.1f}"])
    head = ("range", "ceiling, % of frames", "with the finer grid", "efficiency too high by, % of it")
    return rows([*head, "seen from fewer than 5 gazes, %"], body)


def missed(measured: Mapping[str, Any]) -> dict[str, str]:
    """Misses by seeing gazes and by age."""
    there = {where: found["misses"] for where, found in measured.items() if "misses" in found}
    (first, *_) = there.values()
    body = [[where, *(f"{100 * share:.1f}" for share in one["by_gazes"][1:])] for where, one in there.items()]
    old = [[where, *map(aged, one["missed_by_age"], one["frames_by_age"])] for where, one in there.items()]
    gazes, ages = classes(first["gazes"][1:], first["grid"]), classes(first["ages"], None)
    return {
        "gazes": rows(["range", *gazes], body),
        "ages": rows(["range", *ages], old),
        "frames": listed([f"{one['frames']:,} in {where}" for where, one in there.items()]),
    }


def aged(share: float | None, frames: int) -> str:
    return "" if share is None else f"{100 * share:.0f} ({frames:,})"


def classes(least: Sequence[int], last: int | None) -> list[str]:
    """Names of classes that begin with these numbers."""
    ends = [f"{a}" if b - a == 1 else f"{a} to {b - 1}" for a, b in pairwise(least)]
    return [*ends, f"{least[-1]} and more" if last is None else f"{least[-1]} to {last:,}"]


def cost(found: Mapping[str, StudyResult]) -> str:
    """Cells and processor hours of each study."""
    body, total = [], 0.0
    for name in NAMES:
        there, hours = 0, 0.0
        if name in found:
            seconds = dict(zip(*(found[name].table[each].to_pylist() for each in ("key", "cpu_s")), strict=True))
            there, hours = ended(found[name]), sum(seconds.values()) / 3600
        total += hours
        body.append([f"`studies/{name}.toml`", f"{there:,} of {cells_of(name):,}", f"{hours:.1f}"])
    return rows(["study", "cells", "CPU hours"], [*body, ["all", "", f"{total:.1f}"]])
