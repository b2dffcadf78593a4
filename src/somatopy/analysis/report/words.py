"""What the report says in words: sentences made of a run's numbers, and the captions of its plots."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from somatopy.analysis.bounds import reactive_rate
from somatopy.analysis.claims import VERDICTS, Finding
from somatopy.analysis.order import ORDERED
from somatopy.analysis.phases import played
from somatopy.analysis.regions import FEW
from somatopy.analysis.runs import Run
from somatopy.analysis.series import gaze_stretch, in_shares
from somatopy.analysis.standings import OWN, Standing
from somatopy.analysis.trends import Trend, quantile
from somatopy.clock import DISTORTION_WIDTH, FRAMES_PER_MINUTE, WINDOW

__all__ = [
    "FIGURE_TITLES",
    "OWN_MAPS",
    "captions",
    "claims_line",
    "cost",
    "headline",
    "intervals",
    "minutes",
    "no_maps",
    "tally",
    "untold",
]

FIGURE_TITLES = {
    "robot": "The robot, and what its eye sees",
    "figure2": "Figure 2: maps and their strongest links",
    "figure3": "Figure 3: hits per five minutes, with trends",
    "figure4": "Figure 4: distortion of the arm map",
    "figure5": "Figure 5: distortion of the head map",
    "efficiency": "Beside what was possible",
    "misses": "How often each arm region is missed",
    "filmstrip": "What the head camera saw",
}

OWN_MAPS = (
    "This learner keeps arrays of its own in maps/. They are not two sheets of units with links from one to the other, "
    "as the paper's are, so that Figure 2 and the map explorer are left out."
)
CEILING = "The ceiling is the share of frames in which some head posture would have seen the hand. "
REACTIVE = "The reactive bound is what a gaze would see that knows the arm perfectly, but does not look ahead. "
LEVEL = "A phase of less than two windows is drawn as a level line at its mean. "
MEAN = f"over the last {DISTORTION_WIDTH:,} inputs, after the update"
CAPTIONS = {
    "hits": "Hits are frames in which the marker on the hand was detected. Points are windows of five minutes, "
    f"{WINDOW:,} frames. The pale line is the running minute, scaled to five. Both are drawn where they start. Trends "
    "are least squares over full windows, restarted at the damage and 35 minutes after it, as in the paper.",
    "efficiency": f"{CEILING}{REACTIVE}Both are computed with the geometric eye. Controls, if there are any, ran on "
    f"the same arm movements, with the geometric eye as well. {LEVEL}",
    "arm": f"Mean distance from arm posture to winner {MEAN}; 1 is a joint's whole range (the paper's Figure 4).",
    "head": "The same for the head map (the paper's Figure 5).",
    "gaze": "Angle between the camera's optical axis and the hand, seen or not, over stretches of {}.",
    "misses": "Share of frames in which the hand was not seen, by the arm's true posture. Where no head posture sees "
    f"the hand, it is always missed. White: fewer than {FEW} frames.",
    "beliefs": "Each panel is one arm posture that the run does not contain. Shading: how far the learner believes "
    "that a gaze sees the hand. Red outline: the gazes that see it, by the geometric eye. Yellow: where it would look. "
    "Sand: out of the head's reach. The damage of the phase is applied to what is felt of the arm.",
    "gazes_only": "Each panel is one arm posture that the run does not contain. Red outline: the gazes that see the "
    "hand, by the geometric eye. Yellow: where the learner would look. Sand: out of the head's reach. This learner "
    "does not say what it believes.",
    "agreement": "How often the learner is right, over all panels, at the ends of windows and phases. Two shares are "
    "counted: of the gazes that see the hand, those with a belief of more than one half, and of the other gazes, those "
    "with a belief of at most one half. The balanced accuracy is the mean of the two; 50 % takes no knowledge.",
    "missed_gazes": "The bars sum all misses, those where no gaze of the ceiling's grid sees the hand on the left. "
    "Counted in stretches of consecutive frames, spread evenly over the first and the last phase.",
    "missed_ages": "Share of frames that are missed, of those in which the hand has been visible from some gaze for as "
    "long; 0 is the first frame. Counted in the same stretches.",
    "orders": "The topographic error is the share of inputs, of the two minutes before, whose two nearest units are no "
    f"neighbours in the lattice. Up to {ORDERED[0]} a map is called ordered, above {ORDERED[1]} not ordered: then "
    "places in lattice space mean little, whatever the map's distortion.",
    "maps": "Arm units take the colour of the head unit that their strongest link leads to: the gaze they stand for. "
    "Hollow units have no link yet. Lines: the 100 strongest of those links.",
}
CAPTIONS_OF_SEVERAL = CAPTIONS | {
    "hits": "Points are windows of five minutes, drawn where they start. The running minute, scaled to five, is drawn "
    "of runs of up to half an hour. Trends are least squares over full windows, as in the paper.",
    "efficiency": f"{CEILING}It differs between runs only if arm movements or bodies do; then each run has its own, "
    f"dotted. {LEVEL}",
    "gaze": "Median angle between optical axis and hand, seen or not, over stretches of {}.",
}


def captions(runs: Sequence[Run], units: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """What stands under the plots.

    Args:
        runs: what the page is about.
        units: of each run, the units of its distances, see `distance_units`.
    """
    run, alone = runs[0], len(runs) == 1
    found = CAPTIONS if alone else CAPTIONS_OF_SEVERAL
    if alone and run.ceiling is None:
        text = f"Share of frames with the hand seen; controls ran on the same arm movements. {LEVEL}"
        found = found | {"efficiency": text}
    elif alone and reactive_rate(run) is None:
        found = found | {"efficiency": f"{CEILING}It is computed with the geometric eye. {LEVEL}"}
    stretches = {"one minute" if gaze_stretch(each) == 1 else "five minutes" for each in runs}
    found = found | {"gaze": found["gaze"].format(" or ".join(sorted(stretches, reverse=True)))}
    if not all(in_shares(unit) for told in units for unit in told.values()):
        text = "Mean distance from {} posture to winner " + MEAN + ", in the unit named; the paper's has [0, 1] units."
        found = found | {side: text.format(side) for side in ("arm", "head")}
    return found


def headline(run: Run, summary: Mapping[str, Any], found: Sequence[Standing]) -> str:
    """The result in two or three sentences."""
    phases = [(k, summary["phases"][k]) for k in played(summary["phases"])]
    if not phases:
        return "No frame of this run was recorded."
    parts = [f"{_percent(phase['rate'])} of {phase['frames']:,} frames {_when(summary, k)}" for k, phase in phases]
    sentences = [f"The hand was seen in {_and(parts)}."]
    own = next(standing for standing in found if standing.name == OWN)
    reached = [f"{_percent(own.efficiencies[k], 0)} {_when(summary, k)}" for k, _ in phases if own.efficiencies[k]]
    if reached:
        sentences.append(f"Of what any gaze could have seen, that is {_and(reached)}.")
    controls = [f"{s.name} {_percent(s.rates[phases[0][0]])}" for s in found if s.summary and s is not own]
    if controls:
        sentences.append(
            f"On the same movements the controls saw it, {_when(summary, phases[0][0])}: {_and(controls)}."
        )
    return " ".join(sentences).replace(" %", "\u00a0%")


def cost(measured: Mapping[str, Any] | None) -> str:
    """What the run took, as far as it was measured.

    Example:
        >>> cost({"wall_s": 12.4, "frames": 9000, "frames_per_s": 725.8})
        '9,000 frames took 12 s, 726 frames a second.'
    """
    measured = {key: value for key, value in (measured or {}).items() if isinstance(value, int | float)}
    frames = f"{measured['frames']:,} frames" if "frames" in measured else "The run"
    forms = {
        "wall_s": (1, frames + " took {:,.0f} s"),
        "frames_per_s": (1, "{:,.0f} frames a second"),
        "peak_memory_bytes": (1e6, "{:,.0f} MB of memory"),
    }
    parts = [form.format(measured[key] / unit) for key, (unit, form) in forms.items() if measured.get(key)]
    return f"{', '.join(parts)}." if parts else ""


def tally(verdicts: Sequence[str]) -> str:
    """How many claims hold.

    Example:
        >>> tally(["holds", "cannot tell", "holds"])
        '2 hold, 0 do not, 1 cannot be told'
    """
    holds, not_so, unknown = (list(verdicts).count(verdict) for verdict in VERDICTS)
    return f"{holds} hold, {not_so} do not, {unknown} cannot be told"


def claims_line(found: Sequence[Finding]) -> str:
    """What a run says to the paper's claims, in a sentence or two."""
    holds, not_so, unknown = (sum(finding.verdict == verdict for finding in found) for verdict in VERDICTS)
    if not holds + not_so:
        return ""
    rest = f"; the other {unknown} cannot be told from this run" if unknown else ""
    return (
        f"Of the paper's {len(found)} claims {holds} {'holds' if holds == 1 else 'hold'} and "
        f"{not_so} {'does' if not_so == 1 else 'do'} not{rest}."
    )


def untold(reasons: Sequence[str], of: int, subject: str = "this run") -> str:
    """Why so many claims cannot be told, in one line.

    Args:
        reasons: a clause for each of them.
        of: how many claims there are.
        subject: what cannot tell.

    Example:
        >>> untold(["the run is too short"] * 2 + ["nothing was damaged"], 12)
        '3 of 12 claims cannot be told from this run: the run is too short (2), nothing was damaged (1).'
        >>> untold(["the run is too short"] * 2, 2)
        'None of the 2 claims can be told from this run: the run is too short.'
    """
    counts = Counter(reasons)
    why = ", ".join(f"{reason} ({n})" if len(counts) > 1 else reason for reason, n in counts.most_common())
    if len(reasons) == of:
        return f"None of the {of} claims can be told from {subject}: {why}."
    return f"{len(reasons)} of {of} claims cannot be told from {subject}: {why}."


def no_maps(summary: Mapping[str, Any]) -> str:
    """Why a run without snapshots shows no maps."""
    frames = sum(phase["frames"] for phase in summary["phases"])
    if frames >= WINDOW:
        return "This run kept no maps: its learner has none, or they were not recorded."
    return (
        f"Maps are kept at the end of every {WINDOW // FRAMES_PER_MINUTE} minutes. This run lasted "
        f"{frames / FRAMES_PER_MINUTE:.3g}, so that there are none to show."
    )


def minutes(summary: Mapping[str, Any]) -> list[str]:
    """Length of each phase that has frames, in minutes of robot time."""
    phases = summary["phases"]
    return [f"{phases[index]['frames'] / FRAMES_PER_MINUTE:.1f}" for index in played(phases)]


def intervals(summary: Mapping[str, Any]) -> list[str]:
    """Every trend's slope with its 95 % interval, in order, of phases that have frames; — where there is none."""
    texts = []
    for index in played(summary["phases"]):
        for entry in summary["phases"][index]["trends"]:
            trend = Trend(**entry) if entry else None
            reach = quantile(trend.last - trend.first + 1) * trend.slope_se if trend else 0.0
            texts.append(f"{trend.slope:+.2f} ± {reach:.2f}".replace("-", "−") if trend else "—")
    return texts


def _percent(share: float | None, digits: int = 1) -> str:
    return "none" if share is None else f"{100 * share:.{digits}f} %"


def _when(summary: Mapping[str, Any], index: int) -> str:
    if summary["phases"][index]["damage"] != "none":
        return "after the damage"
    return f"in phase {index + 1}, undamaged" if index else "while intact"


def _and(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
