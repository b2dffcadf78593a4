"""Write docs/reproduction.md and its figures from the tables of cells in studies/.

python docs/make_reproduction.py             from the tables that are there
python docs/make_reproduction.py --run       go on with the studies first; each goes on where it was stopped
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from statistics import fmean

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.analysis.paper_measures import BySeed, Measure, level_after, loss_of_level, measure
from somatopy.analysis.statistics import mean_interval, paired, seeds_needed
from somatopy.analysis.table import PAPER_TRENDS
from somatopy.analysis.verdicts import CLAIMS, Judged, judge_over_seeds
from somatopy.clock import FRAMES_PER_MINUTE, WINDOW
from somatopy.studies import planned
from somatopy.studies.driver import perform
from somatopy.studies.reading import load_plan

ROOT = Path(__file__).parents[1]
STUDIES, IMAGES, PAGE = ROOT / "studies", ROOT / "docs" / "img" / "reproduction", ROOT / "docs" / "reproduction.md"
NAMES = ("reproduction", "controls", "rendered", "ablations")
MAIN = "paper"
OURS, PAPERS = "#3b6fb6", "#c0392b"


def run() -> None:
    """All studies, each from where it was stopped."""
    for name in NAMES:
        perform(planned(load_plan(STUDIES / f"{name}.toml")), STUDIES / name)


def tables() -> dict[str, StudyResult]:
    """The studies that have finished cells, by name."""
    found = {name: load_study(STUDIES / name) for name in NAMES if (STUDIES / name / "study.toml").exists()}
    return {name: result for name, result in found.items() if len(result.table)}


# -- numbers as text ---------------------------------------------------------------------------------------------------


def interval(values: BySeed, form: str = "{:+.1f}") -> str:
    """Mean and 95 % interval."""
    found = mean_interval(list(values.values()))
    if found.mean is None:
        return "n/a"
    if found.low is None or found.high is None:
        return form.format(found.mean)
    return f"{form.format(found.mean)} [{form.format(found.low)}, {form.format(found.high)}]"


def difference(first: BySeed, second: BySeed, form: str = "{:+.1f}") -> str:
    """Mean paired difference, its 95 % interval and p."""
    if len(first.keys() & second.keys()) < 2:
        return "n/a"
    found = paired(first, second)
    one = found.interval
    if one.mean is None or one.low is None or one.high is None:
        return "n/a"
    p = "" if found.p is None else f", p = {found.p:.2g}"
    return f"{form.format(one.mean)} [{form.format(one.low)}, {form.format(one.high)}]{p}"


def percent(values: BySeed) -> BySeed:
    """A share in percent."""
    return {seed: 100 * value for seed, value in values.items()}


def rate(result: StudyResult, name: str, phase: int = 0) -> BySeed:
    """Share of a phase's frames with the hand in view, percent."""
    return percent(measure("rate", phase)(result, name))


def rows(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *body))


# -- the page ----------------------------------------------------------------------------------------------------------


def page(found: dict[str, StudyResult]) -> str:
    """The whole page, as far as there are tables."""
    main = found["reproduction"]
    chance = chance_of(found.get("controls"))
    judged = judge_over_seeds(main, MAIN, chance)
    parts = [HEAD.format(n=len(measure("rate", 0)(main, MAIN)), summary=summary(judged)), verdicts(judged, chance)]
    parts.append(FIGURES)
    parts.append(LAST_SLOPE.format(text=last_slope(judged)))
    parts.append(
        ADAPTATION.format(
            table=two_by_two(main), costs=what_it_costs(main), drop=two_by_two_slopes(main), gradual=gradual(judged)
        )
    )
    if "controls" in found:
        parts.append(CONTROLS.format(table=controls(main, found["controls"])))
    if "rendered" in found:
        parts.append(RENDERED.format(table=rendered(main, found["rendered"])))
    if "ablations" in found:
        parts.append(ABLATIONS.format(table=ablations(found["ablations"])))
    parts.append(COST.format(table=cost(found)))
    return "\n".join(parts)


def chance_of(controls_: StudyResult | None) -> dict[str, BySeed]:
    """What a head that learns nothing shows of each claim about slopes and levels."""
    if controls_ is None or "fixed" not in controls_.conditions:
        return {}
    about_hits = ("learns", "costs", "degrades gradually", "improves again")
    return {claim.key: claim.measure(controls_, "fixed") for claim in CLAIMS if claim.key in about_hits}


def summary(judged: Sequence[Judged]) -> str:
    """Which claims hold, in one sentence each."""
    groups = {word: [one.claim.key for one in judged if one.verdict == word] for word in VERDICT_WORDS}
    return " ".join(
        VERDICT_WORDS[word].format(", ".join(f"*{key}*" for key in keys)) for word, keys in groups.items() if keys
    )


VERDICT_WORDS = {
    "holds": "These claims of the paper hold: {}.",
    "does not hold": "These do not: {}.",
    "cannot tell": "Whether these hold, the seeds cannot tell: {}.",
}


def verdicts(judged: Sequence[Judged], chance: dict[str, BySeed]) -> str:
    """The table of claims."""
    body = []
    for one in judged:
        claim, said = one.claim, ""
        if claim.paper is not None:
            where = {True: "inside", False: "outside", None: ""}[one.paper_is_inside]
            said = f"{claim.form.format(claim.paper)} ({where} the spread of seeds)"
        shown = f"{one.shown.count} of {one.shown.n}" if one.shown else ""
        by_chance = f"{100 * one.shown.chance:.0f} %" if one.shown and claim.key in chance else ""
        p = "" if one.p_holm is None else f"{one.p_holm:.2g}"
        ours = f"{interval(one.values, claim.form)} {claim.unit}".strip()
        body.append(
            [
                f"*{claim.key}*: {claim.text}",
                one.verdict,
                ours,
                said,
                shown,
                by_chance,
                p,
                "yes" if claim.fitted else "no",
            ]
        )
    head = (
        "claim",
        "verdict",
        "mean [95 % interval]",
        "the paper",
        "seeds that show it",
        "by chance",
        "p, Holm",
        "fitted",
    )
    return rows(head, body)


def last_slope(judged: Sequence[Judged]) -> str:
    """How many seeds it would take to tell the paper's last slope from 0."""
    (one,) = (each for each in judged if each.claim.key == "improves again")
    slope, sd = PAPER_TRENDS[2].slope, one.interval.sd
    if sd is None:
        return ""
    return (
        f"The last slope has a standard deviation of {sd:.1f} hits a window over seeds. To tell the paper's "
        f"{slope:+.2f} from 0 with a power of 80 % would take {seeds_needed(slope, sd):,} seeds; the paper has one."
    )


AFTER: tuple[tuple[str, Measure], ...] = (
    ("rate in the first window after", lambda result, name: first_window(result, name)),
    ("rate from 35 min on", lambda result, name: percent(level_after(result, name))),
    ("change since the end of phase 1", lambda result, name: percent(loss_of_level(result, name))),
)


def first_window(result: StudyResult, name: str) -> BySeed:
    """The rate in the first five minutes of phase 2, percent."""
    return {seed: 100 * each[0] / WINDOW for seed, each in measure("hits_per_window", 1)(result, name).items() if each}


def two_by_two(result: StudyResult) -> str:
    """Levels after the damage, with maps and links frozen or plastic."""
    body = [
        [name, *(interval(value(result, name), "{:.1f}") for _, value in AFTER), lost(result, name)]
        for name in result.conditions
    ]
    return rows(["", *(text for text, _ in AFTER), f"from 35 min on, minus *{MAIN}*"], body)


def lost(result: StudyResult, name: str) -> str:
    """Points of rate from minute 35 on, less those of the paper's protocol."""
    if name == MAIN:
        return ""
    return difference(percent(level_after(result, name)), percent(level_after(result, MAIN)))


def two_by_two_slopes(result: StudyResult) -> str:
    """Slopes after the damage."""
    first, rest = measure("slopes", 1, 0), measure("slopes", 1, 1)
    body = []
    for name in result.conditions:
        less = "" if name == MAIN else difference(first(result, name), first(result, MAIN))
        body.append([name, interval(first(result, name)), interval(rest(result, name)), less])
    return rows(["", "slope, first 35 min", "slope, the rest", f"first slope minus that of *{MAIN}*"], body)


def what_it_costs(result: StudyResult) -> str:
    """What the damage costs, and where, in sentences."""
    levels = {name: percent(level_after(result, name)) for name in result.conditions}
    if not {"undamaged", "links only", "maps only"} <= levels.keys():
        return ""
    damage, maps, links = (points(levels[name], levels[MAIN]) for name in ("undamaged", "links only", "maps only"))
    said = (
        f"From minute 35 on, the rate differs from that of the paper's protocol by {damage} without damage, by {maps} "
        f"if the maps stand still after the damage and only the links learn, and by {links} if only the maps learn."
    )
    lasting = all(lower(levels[name], levels[MAIN]) > 0 for name in ("undamaged", "links only"))
    if lasting:
        said += (
            " So the damage does cost something for good. The maps cause this loss: their units move to other "
            "postures, while the links still belong to the old ones."
        )
    return said


def points(first: BySeed, second: BySeed) -> str:
    """A mean difference in points of rate, with its interval."""
    return difference(first, second).partition(", p")[0].replace(" [", " points [")


def lower(first: BySeed, second: BySeed) -> float:
    """Lower end of the interval of a paired difference; minus infinity where it cannot be told."""
    if len(first.keys() & second.keys()) < 2:
        return -math.inf
    low = paired(first, second).interval.low
    return -math.inf if low is None else low


def gradual(judged: Sequence[Judged]) -> str:
    """Whether there is a gradual drop to be explained."""
    (one,) = (each for each in judged if each.claim.key == "degrades gradually")
    if one.verdict == "holds" or one.shown is None or one.interval.mean is None:
        return ""
    return (
        f"A gradual drop over the first 35 minutes is not seen over seeds: its mean slope is {interval(one.values)}, "
        f"and {one.shown.count} of {one.shown.n} seeds have one below 0, as the paper's run has. Single runs vary: "
        f"the standard deviation over seeds is {one.interval.sd:.0f} hits a window."
    )


def controls(main: StudyResult, others: StudyResult) -> str:
    """Every control beside the paper's learner on the same seeds."""
    body = []
    for result, name in ((main, MAIN), *((others, name) for name in others.conditions)):
        cells = [interval(rate(result, name, phase), "{:.1f}") for phase in (0, 1)]
        of_possible = interval(percent(measure("efficiency", 0)(result, name)), "{:.1f}")
        less = (
            ""
            if name == MAIN
            else difference(*(percent(measure("rate", 0)(r, n)) for r, n in ((result, name), (main, MAIN))))
        )
        slope = interval(measure("slopes", 1, 0)(result, name))
        body.append([name, cells[0], of_possible, cells[1], slope, less])
    ceiling = [interval(percent(measure(column, 0)(main, MAIN)), "{:.1f}") for column in ("ceiling", "reactive")]
    body += [["ceiling", ceiling[0], "100", "", "", ""], ["reactive bound", ceiling[1], "", "", "", ""]]
    head = (
        "",
        "phase 1, %",
        "efficiency in phase 1, %",
        "phase 2, %",
        "slope of the first 35 min after",
        f"phase 1 minus *{MAIN}*, same seeds",
    )
    return rows(head, body)


def rendered(main: StudyResult, pictures: StudyResult) -> str:
    """Rendered pictures beside the geometric eye on equal seeds."""
    (name,) = pictures.conditions
    body = []
    for claim in CLAIMS:
        if claim.rule == "level" and claim.key == "stays":
            continue
        real, model = claim.measure(pictures, name), claim.measure(main, MAIN)
        shared = {seed: value for seed, value in model.items() if seed in real}
        body.append(
            [
                f"*{claim.key}*",
                interval(real, claim.form),
                interval(shared, claim.form),
                difference(real, shared, claim.form),
            ]
        )
    return rows(["", "rendered", "geometric, same seeds", "difference"], body)


def ablations(result: StudyResult) -> str:
    """One setting changed at a time."""
    first = result.conditions[0]
    body = []
    for name in result.conditions:
        slopes = [interval(measure("slopes", phase, 0)(result, name)) for phase in (0, 1)]
        after = interval(percent(level_after(result, name)), "{:.1f}")
        less = "" if name == first else difference(*(percent(measure("rate", 0)(result, n)) for n in (name, first)))
        body.append(
            [name, interval(percent(measure("rate", 0)(result, name)), "{:.1f}"), slopes[0], slopes[1], after, less]
        )
    head = ("", "phase 1, %", "slope of phase 1", "first slope after", "from 35 min on, %", f"phase 1 minus *{first}*")
    return rows(head, body)


def cost(found: dict[str, StudyResult]) -> str:
    """Processor hours of each study."""
    body, total = [], 0.0
    for name, result in found.items():
        seconds = dict(zip(result.table["key"].to_pylist(), result.table["cpu_s"].to_pylist(), strict=True))
        total += sum(seconds.values())
        body.append([f"`studies/{name}.toml`", f"{len(seconds)}", f"{sum(seconds.values()) / 3600:.1f}"])
    return rows(["study", "cells", "CPU hours"], [*body, ["all", "", f"{total / 3600:.1f}"]])


HEAD = """# Does it do what the paper says?

Schillaci, Hafner and Lara (2014) let a simulated NAO learn for 304 minutes, once. Here is the same experiment over {n}
seeds, in full length and with physics. The eye is the geometric one, a model of the detector;
[further down](#rendered-pictures) it stands beside rendered pictures and the real detector.

{summary}

The page on the [calibration](calibration.md) says how the settings that the paper leaves open were chosen, and which of
the paper's numbers they were fitted to. A claim that is marked as *fitted* was asked for in the calibration; that it
holds is no discovery.

The seed is the unit. A claim holds if the 95 % interval of the mean over seeds says so (bootstrap from 20 seeds on,
Student's t below); *level* is a test of equivalence with margins that were fixed beforehand. The paper's numbers come
from its one run, and are compared with the range into which one more of our seeds would fall. *By chance* is the share
of seeds that show what is claimed although the head is held still, in the posture that sees the hand most often. *p,
Holm* is of the test behind a verdict, corrected for the number of claims; verdicts themselves are not corrected.
"""

FIGURES = """
![Hits per window](img/reproduction/figure3.png)

*Figure 3 of the paper, over seeds: hits in windows of five minutes. The line is the mean, the band holds 95 % of the
seeds, the thin lines are the paper's three trends.*

![Distortion of the arm map](img/reproduction/figure4.png)

*Figure 4 over seeds: distortion of the arm map, mean and band as above. The paper gives no numbers.*

![Distortion of the head map](img/reproduction/figure5.png)

*Figure 5 over seeds: distortion of the head map. The grey band is the paper's, 0.01 to 0.02.*

Figure 2, the maps and their links in joint space, is drawn for a single run by `somatopy reproduce`.
"""

LAST_SLOPE = """
## The last slope

{text}
"""

ADAPTATION = """
## Where adaptation happens, and what the damage costs

All rows have the same first phase. In *paper* the damage follows, and maps and links go on learning; in *undamaged*
there is no damage. In the other rows the damage follows, and only the links learn, only the maps, or nothing
(*stopped*). Rates are in percent of frames.

{table}

{costs}

Slopes in hits per window, per window:

{drop}

{gradual}
"""

CONTROLS = """
## Controls, and what a best fixed head scores

All learners meet the same arm movements. [What each control is](studies.md#controls); *fixed* holds the head in the one
posture that sees the hand most often while babbling. *paper* has 30 seeds and the controls have the first ten of them.
The last column compares equal seeds, so that it is not the difference of two entries of the first.

{table}
"""

RENDERED = """
## Rendered pictures

The geometric eye is used above because it is fast. On ten of the seeds the experiment ran with rendered pictures and
the real detector as well:

{table}
"""

ABLATIONS = """
## One setting at a time

Each row changes one setting of the preset `paper`. Motion is kinematic, with five seeds each. Differences are paired by
seed. `studies/ablations.toml` has the settings; these need a word:

- *Neighbourhood as printed* and *of 2016*: the [presets](maps/dsom.md) `printed` and `schillaci2016` of the maps.
- *No centring*: a hit counts in full, wherever the hand is in the picture.
- *Rows normalised*: the links of a unit sum to 1.
- *Ties*: where several links are equally strong, the preset draws one of them in each frame. *Held* keeps the one that
  was drawn as long as the arm map's winner stays the same, and *first* takes the first.
- *Head at its limit*: the head turns as fast as its motors can.

{table}
"""

COST = """
## What it cost

`python docs/make_reproduction.py` writes this page from the tables in `studies/`, and with `--run` it runs what is
missing there.

{table}
"""


# -- figures -----------------------------------------------------------------------------------------------------------


def draw(main: StudyResult) -> None:
    """Figures 3, 4 and 5 over seeds."""
    IMAGES.mkdir(parents=True, exist_ok=True)
    save("figure3", figure3, main)
    for name, column in (("figure4", "arm_distortion"), ("figure5", "head_distortion")):
        save(name, lambda axes, result, column=column: distortion(axes, result, column), main)


def save(name: str, drawn: object, main: StudyResult) -> None:
    figure = Figure(figsize=(7.2, 3.6), layout="constrained")
    axes = figure.subplots()
    drawn(axes, main)  # type: ignore[operator]
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_xlabel("time (windows of 5 minutes)")
    figure.legend(*axes.get_legend_handles_labels(), frameon=False, fontsize=8, loc="outside lower center", ncols=3)
    figure.savefig(IMAGES / f"{name}.png", dpi=150, metadata={"Software": None})


def curves(result: StudyResult, column: str, phase: int) -> np.ndarray:
    """A list column of all seeds, shape (seeds, points); what is not known is NaN."""
    listed = list(measure(column, phase)(result, MAIN).values())
    points = min(len(each) for each in listed)
    return np.array([each[:points] for each in listed], float)


def band(axes: Axes, at: np.ndarray, values: np.ndarray, label: str | None) -> None:
    known = np.isfinite(values).all(axis=0)
    low, high = np.quantile(values[:, known], [0.025, 0.975], axis=0)
    axes.fill_between(at[known], low, high, color=OURS, alpha=0.2, lw=0, label=label and "95 % of the seeds")
    axes.plot(at[known], values[:, known].mean(axis=0), color=OURS, lw=1.6, label=label)


def border(axes: Axes, result: StudyResult) -> float:
    """Where the damage is, in windows."""
    at = fmean(measure("frames", 0)(result, MAIN).values()) / WINDOW
    axes.axvline(at, color="0.4", lw=0.8, ls=":")
    axes.annotate("damage", (at, 1.0), xycoords=("data", "axes fraction"), xytext=(3, -3), textcoords="offset points",
                  va="top", fontsize=8, color="0.35")  # fmt: skip
    return at


def figure3(axes: Axes, result: StudyResult) -> None:
    at = border(axes, result)
    for phase, start in ((0, 0.0), (1, at)):
        counts = curves(result, "hits_per_window", phase)
        band(axes, start + np.arange(counts.shape[1]) + 0.5, counts, "mean over seeds" if phase == 0 else None)
    for trend, start in zip(PAPER_TRENDS, (0.0, at, at), strict=True):
        span = np.array([trend.first, trend.last + 1.0])
        label = "the paper's trends" if trend is PAPER_TRENDS[0] else None
        axes.plot(start + span, trend.at(span - trend.first), color=PAPERS, lw=1.2, label=label)
    axes.set_ylabel("hits per window")
    axes.set_ylim(0, WINDOW)


def distortion(axes: Axes, result: StudyResult, column: str) -> None:
    at, minute = border(axes, result), FRAMES_PER_MINUTE / WINDOW
    if column == "head_distortion":
        axes.axhspan(0.01, 0.02, color="0.85", lw=0, label="the paper's band")
    for phase, start in ((0, 0.0), (1, at)):
        values = curves(result, column, phase)
        band(axes, start + (1 + np.arange(values.shape[1])) * minute, values, "mean over seeds" if phase == 0 else None)
    axes.set_ylabel("distortion, [0, 1] units")
    axes.set_ylim(0, None)


def main() -> None:
    """Run what is not finished if asked for, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="store_true", help="go on with the studies first")
    if parser.parse_args().run:
        run()
    found = tables()
    draw(found["reproduction"])
    PAGE.write_text(page(found), encoding="utf-8")
    print(PAGE, file=sys.stderr)


if __name__ == "__main__":
    main()
