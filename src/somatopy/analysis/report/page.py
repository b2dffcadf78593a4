"""The page: what is said, in which order; the template beside this file says how it looks."""

from __future__ import annotations

import base64
import io
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from somatopy.analysis import style
from somatopy.analysis.band import verdict_rows, verdicts_of
from somatopy.analysis.bounds import why_no_ceiling
from somatopy.analysis.claims import VERDICTS, Claim, Finding, judge
from somatopy.analysis.comparison import compare
from somatopy.analysis.described import PROVENANCE, leaves, on_papers_robot, remarks_of, written_by
from somatopy.analysis.groups import Group, as_study, grouped
from somatopy.analysis.order import orders
from somatopy.analysis.phases import kind_name, phase_title, played
from somatopy.analysis.report.beliefs import belief_panels
from somatopy.analysis.report.charts import (
    distortion_chart,
    efficiency_chart,
    gaze_chart,
    hits_chart,
    misses_chart,
)
from somatopy.analysis.report.explorer import explorer
from somatopy.analysis.report.rendering import embeddable, rendered
from somatopy.analysis.report.sight_charts import ages_chart, agreement_chart, gazes_chart
from somatopy.analysis.report.study_tables import WORDS, differences, means, tables_to_copy
from somatopy.analysis.report.words import (
    FIGURE_TITLES,
    OWN_MAPS,
    captions,
    claims_line,
    cost,
    headline,
    intervals,
    minutes,
    no_maps,
    tally,
    untold,
)
from somatopy.analysis.runs import Run, RunFolderError, load_run, writing
from somatopy.analysis.series import distance_units
from somatopy.analysis.sight import why_no_sight
from somatopy.analysis.standings import Standing, standings
from somatopy.analysis.summary import summarise
from somatopy.analysis.table import comparison
from somatopy.files import write_whole

__all__ = ["Source", "render_report", "write_report"]

#: Plots of a run that is alone, by the name of their place.
OF_ONE = {
    "misses": misses_chart,
    "agreement": agreement_chart,
    "missed_gazes": gazes_chart,
    "missed_ages": ages_chart,
}
#: Widest picture that is embedded, px.
WIDEST = 1400
WIDE = ("robot", "figure2", "misses", "filmstrip")


@dataclass(frozen=True)
class Source:
    """A run to report on.

    Attributes:
        name: what the page calls it.
        run: its folder.
        summary: its measures.
        standings: bounds, itself, controls.
        units: unit of the distances from arm and head to their winners.
        on_papers_robot: whether its robot is the paper's.
    """

    name: str
    run: Run
    summary: Mapping[str, Any]
    standings: Sequence[Standing]
    units: Mapping[str, str]
    on_papers_robot: bool

    @classmethod
    def of(cls, path: str | os.PathLike[str], name: str | None = None) -> Source:
        """Open a run folder and compute what the report says of it."""
        run = load_run(path)
        summary, named = summarise(run), name or run.path.resolve().name
        return cls(named, run, summary, standings(run, summary), distance_units(run), on_papers_robot(run))


def write_report(
    paths: Sequence[str | os.PathLike[str]], out: str | os.PathLike[str] | None = None, missing: Sequence[str] = ()
) -> Path:
    """Write the report of one run, or of several side by side.

    Args:
        paths: run folders.
        out: the file; report.html in the first folder if None.
        missing: sentences that say which pictures could not be drawn, and why. They stand below the page's figures.

    Returns:
        The file, replaced as a whole or not at all.

    Raises:
        ValueError: no folder is named.
        RunFolderError: a folder cannot be used.
    """
    if not paths:
        raise ValueError("A report needs at least one run folder.")
    target = Path(out) if out is not None else Path(paths[0]) / "report.html"
    sources = [Source.of(path, name) for path, name in zip(paths, _names(paths), strict=True)]
    text = render_report(sources, missing)
    with writing(target):
        write_whole(target, text)
    return target


def render_report(sources: Sequence[Source], missing: Sequence[str] = ()) -> str:
    """The page as text: everything in it, nothing to fetch. Arguments as in `write_report`."""
    return rendered("page.html", _content(sources) | {"missing": missing})


def _names(paths: Sequence[str | os.PathLike[str]]) -> list[str]:
    """The shortest ends of the paths that tell them apart."""
    parts = [Path(path).resolve().parts for path in paths]
    for depth in range(1, max(map(len, parts)) + 1):
        names = ["/".join(part[-depth:]) for part in parts]
        if len(set(names)) == len(set(parts)):
            break
    return [f"{name} ({k})" if names[:k].count(name) else name for k, name in enumerate(names)]


def _content(sources: Sequence[Source]) -> dict[str, Any]:
    first, alone = sources[0], len(sources) == 1
    judged = [judge(found.summary, found.units, found.on_papers_robot) for found in sources]
    beside = any(found.on_papers_robot for found in sources)
    maps = explorer(first.run) if alone else None
    beliefs = belief_panels(first.run, first.summary) if alone else None
    claims = _claims(judged) if beside else []
    band = verdict_rows(verdicts_of(first.run)) if alone else []
    return {
        "title": first.name if alone else f"{len(sources)} runs compared",
        "alone": alone,
        "sources": sources,
        "first": first,
        "headline": headline(first.run, first.summary, first.standings) if alone else "",
        "tallies": [tally([finding.verdict for _, finding in found]) for found in judged],
        "verdicts": VERDICTS,
        "claims": claims,
        "claims_line": claims_line([finding for _, finding in judged[0]]) if alone and beside else "",
        "untold": _untold(claims),
        "band": [row for row in band if row["verdict"] != "cannot tell"],
        "band_open": [row for row in band if row["verdict"] == "cannot tell"],
        "band_untold": _untold_over_seeds(band),
        "plots": {name: embeddable(json.loads(figure.to_json())) for name, figure in _charts(sources)},
        "captions": captions([source.run for source in sources], [source.units for source in sources]),
        "facts": style.source(first.summary).replace(", ", " · "),
        "no_ceilings": [(s.name, why) for s in sources if (why := why_no_ceiling(s.run, s.summary))],
        "phases": [phase_title(first.summary, index) for index in played(first.summary["phases"])],
        "standings": [_standing_row(found, first.summary) for found in first.standings],
        "overview": [_overview(source) for source in sources],
        "settings": _differences(sources),
        **_over_seeds(sources),
        "maps": maps and embeddable(maps),
        "beliefs": beliefs,
        "beliefs_data": beliefs and embeddable(beliefs),
        "no_sight": why_no_sight(first.run, first.summary) if alone else "",
        "orders": orders(first.run, first.summary) if maps else [],
        "own_maps": _why_no_maps(first) if alone and maps is None else "",
        "figures": list(_pictures(first.run)) if alone else [],
        "rows": comparison(first.summary, first.units, first.on_papers_robot) if alone else [],
        "beside_paper": beside,
        "runs": [_what_was_run(source) for source in sources],
    }


def _claims(judged: Sequence[Sequence[tuple[Claim, Finding]]]) -> list[dict[str, Any]]:
    """Each claim with what every run says to it, and whether any run can tell."""
    claims = []
    for index, (claim, _) in enumerate(judged[0]):
        findings = [found[index][1] for found in judged]
        told = any(finding.verdict != "cannot tell" for finding in findings)
        counts = tally([finding.verdict for finding in findings])
        claims.append({"claim": claim, "findings": findings, "told": told, "tally": counts})
    return claims


def _untold(claims: Sequence[Mapping[str, Any]]) -> str:
    """One line about those that no run can tell; "" where there are none."""
    reasons = [entry["findings"][0].why for entry in claims if not entry["told"]]
    several = any(len(entry["findings"]) > 1 for entry in claims)
    return untold(reasons, len(claims), "any of these runs" if several else "this run") if reasons else ""


def _untold_over_seeds(band: Sequence[Mapping[str, str]]) -> str:
    short = "the runs are too short"
    reasons = [
        short if row["ours"] == "too short" else "the interval leaves it open"
        for row in band
        if row["verdict"] == "cannot tell"
    ]
    return untold(reasons, len(band), "these seeds") if reasons else ""


def _why_no_maps(source: Source) -> str:
    """What to say where there is no map explorer."""
    return OWN_MAPS if source.run.snapshots else no_maps(source.summary)


def _charts(sources: Sequence[Source]) -> Iterator[tuple[str, Any]]:
    drawn = [(source.name, source.run, source.summary) for source in sources]
    charts = {
        "hits": hits_chart(drawn),
        "efficiency": efficiency_chart(drawn, {source.name: source.standings for source in sources}),
        "arm": distortion_chart(drawn, "arm"),
        "head": distortion_chart(drawn, "head"),
        "gaze": gaze_chart(drawn),
    }
    if len(sources) == 1:
        charts |= {name: draw(sources[0].run, sources[0].summary) for name, draw in OF_ONE.items()}
    return ((name, figure) for name, figure in charts.items() if figure is not None)


def _overview(source: Source) -> dict[str, Any]:
    """A run in a row: rates, efficiencies and slopes."""
    own = next(found for found in source.standings if found.summary is source.summary)
    row = _standing_row(own, source.summary)
    row["learner"] = kind_name(str(source.summary["learner"]))
    return row | {"source": source, "trends": intervals(source.summary), "minutes": minutes(source.summary)}


def _standing_row(found: Standing, summary: Mapping[str, Any]) -> dict[str, Any]:
    """What was scored in each phase that has frames: the rate, and its share of the ceiling."""
    cells = [(found.rates[index], found.efficiencies[index]) for index in played(summary["phases"])]
    return {"name": found.name, "eye": found.eye, "cells": cells}


def _differences(sources: Sequence[Source]) -> list[tuple[str, list[tuple[str, list[str]]]]]:
    """Settings in which the runs differ, each with its values and the runs that have them."""
    described = [dict(leaves(source.run.description)) for source in sources]
    keys = sorted({key for found in described for key in found if key.partition(".")[0] not in PROVENANCE})
    values: dict[str, dict[str, list[str]]] = {key: {} for key in keys}
    for key, found in values.items():
        for source, settings in zip(sources, described, strict=True):
            found.setdefault(str(settings.get(key, "—")), []).append(source.name)
    return [(key, [*found.items()]) for key, found in values.items() if len(found) > 1]


def _over_seeds(sources: Sequence[Source]) -> dict[str, Any]:
    """Runs that differ in nothing but their seed together."""
    groups = grouped([(source.name, source.run) for source in sources]) if len(sources) > 1 else []
    comparison = compare(as_study(groups))
    return {
        "words": WORDS,
        "groups": [_group(group) for group in groups],
        "means": means(comparison),
        "differences": differences(comparison),
        "tables": tables_to_copy(comparison),
    }


def _group(group: Group) -> dict[str, str]:
    members = ", ".join(f"{name} (seed {seed})" for seed, (name, _) in group.runs.items())
    return {"name": group.name, "members": members, "twice": ", ".join(group.twice)}


def _pictures(run: Run) -> Iterator[dict[str, Any]]:
    """The run's figures, as far as they were drawn, made small enough to be carried along."""
    for name, title in FIGURE_TITLES.items():
        path = run.path / "figures" / f"{name}.png"
        if path.is_file():
            uri = f"data:image/webp;base64,{base64.b64encode(_packed(path)).decode('ascii')}"
            yield {"title": title, "wide": name in WIDE, "uri": uri, "file": f"figures/{name}.svg"}


def _packed(path: Path) -> bytes:
    from PIL import Image

    packed = io.BytesIO()
    try:
        with Image.open(path) as picture:
            picture.thumbnail((WIDEST, 4 * WIDEST), Image.Resampling.LANCZOS)
            picture.convert("RGB").save(packed, "WEBP", quality=80, method=4)
    except (OSError, SyntaxError) as error:  # SyntaxError: what Pillow calls half a PNG
        raise RunFolderError(f"{path} is no whole picture ({error}). Delete it, and report the run again.") from error
    return packed.getvalue()


def _what_was_run(source: Source) -> dict[str, Any]:
    run = source.run
    described = {key: value for key, value in run.description.items() if key not in PROVENANCE}
    cite = run.description.get("cite", [])
    return {
        "name": source.name,
        "settings": list(leaves(described)),
        "written_by": written_by(run),
        "remarks": remarks_of(run),
        "cite": cite if isinstance(cite, list) else [cite],
        "cost": cost(run.cost),
    }
