"""Repeat the calibration, stage by stage, and write docs/calibration.md from its tables.

    python docs/make_calibration.py            go on with whatever is not finished, then write the page
    python docs/make_calibration.py --page     write the page from the tables that are there

Two stages, each a study whose folder lies in studies/: *search* (kinematic motion, geometric eye), and *choose* among
those that came near (with physics). They are confirmed by the studies of docs/make_reproduction.py, with physics, and
with rendered pictures. No seed is in two of them. Each goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import tomllib
from pathlib import Path
from typing import Any

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.analysis.paper_loss import LANDMARKS, distances, paper
from somatopy.analysis.statistics import mean_interval, paired
from somatopy.analysis.verdicts import judge_over_seeds
from somatopy.studies import planned
from somatopy.studies.driver import perform
from somatopy.studies.reading import load_plan
from somatopy.studies.search import LOSSES_FILE, search, searched

ROOT = Path(__file__).parents[1]
STUDIES = ROOT / "studies"
SEARCH, CHOOSE = (STUDIES / f"calibration-{stage}" for stage in ("search", "choose"))
CONFIRM, RENDERED = STUDIES / "reproduction", STUDIES / "rendered"
CHOOSE_SEEDS = range(1100, 1105)
#: Of the search's proposals, so many at most are tried again on seeds of their own.
MOST = 6
PAGE = ROOT / "docs" / "calibration.md"
#: The paper's protocol in the study that confirms.
MAIN = "paper"


def stages() -> None:
    """Both stages, each from where it was stopped."""
    search(searched(load_plan(STUDIES / "calibration-search.toml")), SEARCH)
    choose()


def choose() -> None:
    """The second stage: the nearest proposals with physics, under seeds of its own."""
    conditions = [{"name": name, **settings} for name, settings in candidates().items()]
    every = {"motion": "dynamic", "eye": "geometric"}
    table = {"name": CHOOSE.name, "preset": "paper-wide", "seeds": list(CHOOSE_SEEDS), "ceilings": False}
    perform(planned({**table, "every": every, "conditions": conditions}), CHOOSE)


def settings_of(folder: Path) -> dict[str, dict[str, Any]]:
    """Settings by name of the condition, as the study's plan has them."""
    plan = tomllib.loads((folder / "study.toml").read_text(encoding="utf-8"))
    return {name: {k: decoded(v) for k, v in entry["factors"].items()} for name, entry in plan["conditions"].items()}


def decoded(value: Any) -> Any:
    """A factor, which a plan writes as JSON where it is a list."""
    return json.loads(value) if isinstance(value, str) and value.startswith(("[", "{")) else value


def candidates() -> dict[str, dict[str, Any]]:
    """The proposals within one scale of the search's best, the best `MOST` of them."""
    losses = json.loads((SEARCH / LOSSES_FILE).read_text(encoding="utf-8"))["losses"]
    known = sorted((loss, name) for name, loss in losses.items() if loss is not None)
    near = [name for loss, name in known if loss <= known[0][0] + 1]
    settings = settings_of(SEARCH)
    return {name: settings[name] for name in near[:MOST]}


def chosen() -> dict[str, dict[str, Any]]:
    """The one with the least loss on the seeds that choose."""
    result = load_study(CHOOSE)
    best = min(result.conditions, key=lambda name: paper(result, name))
    return {best: settings_of(CHOOSE)[best]}


# -- the page ----------------------------------------------------------------------------------------------------------


def page() -> str:
    """docs/calibration.md, from the tables."""
    parts = [HEAD.format(landmarks=landmarks(), space=space(), **counts())]
    parts.append(SEARCHED.format(table=nearest(load_study(SEARCH), 10)))
    if (CHOOSE / "study.toml").exists():
        result = load_study(CHOOSE)
        (name,) = chosen()
        parts.append(
            CHOSEN.format(
                table=nearest(result, MOST),
                name=name,
                settings=setting_lines(chosen()[name]),
                claims=shares(result),
                count=len(within(result)),
            )
        )
    if (CONFIRM / "study.toml").exists() and MAIN in (result := load_study(CONFIRM)).conditions:
        parts.append(
            CONFIRMED.format(table=confirmed(result), n=len(result.values(MAIN, "rate")), claims=claims(result))
        )
        if (RENDERED / "study.toml").exists() and (pictures := load_study(RENDERED)).conditions:
            parts.append(IN_PICTURES.format(**differences(result, pictures)))
    return "\n".join(parts)


def counts() -> dict[str, Any]:
    plan = searched(load_plan(STUDIES / "calibration-search.toml"))
    return {"trials": plan.trials, "seeds": len(plan.seeds), "start": len(plan.start), "most": MOST}


def landmarks() -> str:
    rows = ["| landmark | the paper | scale | where it is from |", "|---|---|---|---|"]
    for mark in LANDMARKS:
        if mark.low == mark.high:
            said = f"{mark.low:.4g}"
        elif math.isinf(mark.high):
            said = f"{mark.low:g} or more"
        elif mark.low == 0:
            said = f"{mark.high:g} or less"
        else:
            said = f"{mark.low:g} to {mark.high:g}"
        rows.append(f"| {mark.name} | {said} | {mark.scale:g} | {mark.source} |")
    return "\n".join(rows)


def space() -> str:
    plan = searched(load_plan(STUDIES / "calibration-search.toml"))
    rows = ["| setting | searched |", "|---|---|"]
    for key, one in plan.space.items():
        if "choices" in one:
            said = "; ".join(
                json.dumps(choice) if isinstance(choice, list) else f"{choice}" for choice in one["choices"]
            )
        else:
            said = f"{one['low']} to {one['high']}" + (", logarithmic" if one.get("log") else "")
        rows.append(f"| `{key}` | {said} |")
    return "\n".join(rows)


def nearest(result: StudyResult, most: int) -> str:
    """The conditions with the least loss, their distances to the landmarks in scales."""
    names = sorted(result.conditions, key=lambda name: paper(result, name))[:most]
    marks = [mark.name for mark in LANDMARKS]
    rows = [f"| | loss | {' | '.join(marks)} |", "|---" * (len(marks) + 2) + "|"]
    for name in names:
        found = distances(result, name)
        rows.append(f"| {name} | {paper(result, name):.2f} | {' | '.join(f'{found[mark]:+.1f}' for mark in marks)} |")
    return "\n".join(rows)


def within(result: StudyResult) -> list[str]:
    """The conditions within one scale of the best."""
    losses = {name: paper(result, name) for name in result.conditions}
    return [name for name, loss in losses.items() if loss <= min(losses.values()) + 1]


def setting_lines(settings: dict[str, Any]) -> str:
    return "\n".join(f"{key} = {json.dumps(value)}" for key, value in settings.items())


def shares(result: StudyResult) -> str:
    """In what share of the near settings each claim holds."""
    near = within(result)
    judged = [judge_over_seeds(result, name) for name in near]
    rows = ["| claim | fitted | holds in |", "|---|---|---|"]
    for each in zip(*judged, strict=True):
        holds = sum(one.verdict == "holds" for one in each)
        claim = each[0].claim
        rows.append(f"| {claim.text} | {'yes' if claim.fitted else 'no'} | {holds} of {len(near)} |")
    return "\n".join(rows)


def claims(result: StudyResult) -> str:
    """Every claim with what the confirmation says to it."""
    name = MAIN
    rows = ["| claim | fitted | mean | 95 % interval | the paper | verdict |", "|---|---|---|---|---|---|"]
    for one in judge_over_seeds(result, name):
        form, interval = one.claim.form, one.interval
        if interval.mean is None or interval.low is None or interval.high is None:
            continue
        paper_said = "" if one.claim.paper is None else form.format(one.claim.paper)
        rows.append(
            f"| {one.claim.text} | {'yes' if one.claim.fitted else 'no'} | {form.format(interval.mean)} | "
            f"{form.format(interval.low)} to {form.format(interval.high)} | {paper_said} | {one.verdict} |"
        )
    return "\n".join(rows)


def confirmed(result: StudyResult) -> str:
    """Mean and spread of each landmark on the seeds that confirm."""
    name = MAIN
    rows = [
        "| landmark | the paper | mean | standard deviation of a seed | distance in scales |",
        "|---|---|---|---|---|",
    ]
    found = distances(result, name)
    for mark in LANDMARKS:
        interval = mean_interval(list(mark.value(result, name).values()))
        said = f"{mark.low:.4g}" if mark.low == mark.high else f"{mark.low:g} to {mark.high:g}"
        rows.append(f"| {mark.name} | {said} | {interval.mean:.4g} | {interval.sd:.2g} | {found[mark.name]:+.1f} |")
    return "\n".join(rows)


def differences(geometric: StudyResult, rendered: StudyResult) -> dict[str, str]:
    """Rendered less geometric on equal seeds: the table, and what it means for the search."""
    (name,) = rendered.conditions
    rows = ["| landmark | rendered minus geometric | 95 % interval | p |", "|---|---|---|---|"]
    apart = []
    for mark in LANDMARKS:
        found = paired(mark.value(rendered, name), mark.value(geometric, MAIN))
        one = found.interval
        if one.low > 0 or one.high < 0:
            apart.append(mark.name)
        p = "" if found.p is None else f"{found.p:.2g}"
        rows.append(f"| {mark.name} | {one.mean:+.2g} | {one.low:+.2g} to {one.high:+.2g} | {p} |")
    said = (
        f"These differ by more than chance: {', '.join(apart)}. Their targets would have to be shifted by as much, and "
        "the search repeated."
        if apart
        else "None differs by more than chance. So no target was shifted, and no second search was needed."
    )
    return {"table": "\n".join(rows), "said": said}


HEAD = """# How the experiment was calibrated

The paper (Schillaci, Hafner and Lara 2014) leaves open in which range and how fast the arm babbles, how fast the head
moves, how fast and how elastically the maps learn, and more. This page says how these settings were chosen. It is the
one place where settings are fitted to the paper's curves. `python docs/make_calibration.py` repeats all of it and
writes this page; the tables that it is written from lie in `studies/calibration-*`.

## What was fixed beforehand

Before the first run we fixed the loss, the space, the number of proposals, and which seeds serve which stage.

**The loss** says how far a proposed setting is from the paper. It compares eight *landmarks*, which are numbers of the
paper's text and curves, with the means over seeds. Each distance is divided by the *scale* of its landmark, and the
loss is the root mean square of the results. *Scale of a trial* is the standard deviation over the ten seeds of an
earlier trial.

{landmarks}

The paper says of its third trend that the hand is seen more and more often again. This trend is not fitted. Landmarks
of Figures 4 and 5 are fitted as bands, since the paper gives no numbers there. Distortions are compared in the unit in
which the maps measure them.

**The space** is what the paper leaves open.

{space}

**The search** is optuna's tree-structured Parzen estimator: {trials} proposals, each under {seeds} seeds. The first
{start} were given: settings that an earlier trial with a simpler simulation found, and those that the preset `paper`
had until then, which is `paper-wide` now. The search runs with the geometric eye, kinematic motion and full length. The
{most} nearest proposals within one scale of the best run again with physics on five other seeds; the one with the least
loss there is chosen. It is confirmed on thirty further seeds with physics, and on ten of them with rendered pictures
and the real detector.

One thing changed while the search ran: the choice had been planned with eight seeds and without physics. The preset has
physics, so it chooses with physics; fewer seeds and proposals pay for that.
"""

SEARCHED = """
## The search

The ten proposals that came nearest, with the distance to each landmark in scales:

{table}
"""

CHOSEN = """
## The choice

The same proposals with physics, on the seeds that choose:

{table}

**{name}** has the least loss. The preset `paper` is this setting, its numbers rounded to two digits:

```
{settings}
```

There are {count} settings within one scale of it. A claim that holds in all of them does not depend on the choice. A
claim that is marked as fitted was asked for by the loss, so that its holding is no discovery.

{claims}
"""

CONFIRMED = """
## The confirmation

{n} seeds that nothing else has seen, with physics. Only these numbers are a result.

{table}

{claims}
"""

IN_PICTURES = """
## Rendered pictures

The same seeds with rendered pictures and the real detector, minus the geometric eye:

{table}

{said}
"""


def main() -> None:
    """Run what is not finished, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--page", action="store_true", help="only write the page")
    if not parser.parse_args().page:
        stages()
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE, file=sys.stderr)


if __name__ == "__main__":
    main()
