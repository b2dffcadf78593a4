"""Write the tables of docs/best.md from the tables of cells in studies/.

python docs/make_best.py             from the tables that are there
python docs/make_best.py --run       go on with the studies first; each goes on where it was stopped

A table stands between two comments, <!-- parts --> and <!-- end of parts -->; all else is written by hand. Variants of
the learner are in docs/best_variants.py. Run this in the folder of the repository.
"""

from __future__ import annotations

import argparse
import re
import sys
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path

from somatopy.analysis.cells import StudyResult, load_study
from somatopy.analysis.statistics import Interval, mean_interval, paired
from somatopy.clock import WINDOW

ROOT = Path(__file__).parents[1]
STUDIES, PAGE = ROOT / "studies", ROOT / "docs" / "best.md"
#: Which parts earn what in the mechanical range, the same in that of paper-wide, and rates, delays and head speeds.
PARTS, WIDE, RATES = NAMES = ("best", "best-wide", "best-rates")
FULL = "full"
BLOCK = re.compile(r"(<!-- (\w+) -->\n).*?(<!-- end of \2 -->)", re.DOTALL)

BySeed = dict[int, float]
Found = dict[str, StudyResult]
#: Phase, and its windows of five minutes from one to before another; the first phase is an hour.
Moment = tuple[int, int, int]
SECOND, END, FIRST_AFTER, REST_AFTER = (0, 1, 2), (0, 9, 12), (1, 0, 1), (1, 1, 3)
HEADS = ("minutes 5 to 10", "minutes 45 to 60", "after the damage: 0 to 5", "5 to 15")
MOMENTS = (SECOND, END, FIRST_AFTER, REST_AFTER)


def run() -> None:
    """All studies, each from where it was stopped."""
    from somatopy.studies import planned
    from somatopy.studies.driver import perform
    from somatopy.studies.reading import load_plan

    for name in NAMES:
        perform(planned(load_plan(STUDIES / f"{name}.toml")), STUDIES / name, processes=1)


def tables() -> Found:
    """The studies that have finished cells, by name."""
    found = {name: load_study(STUDIES / name) for name in NAMES if (STUDIES / name / "study.toml").exists()}
    return {name: result for name, result in found.items() if len(result.table)}


# -- numbers as text ---------------------------------------------------------------------------------------------------


def efficiency(result: StudyResult, name: str, moment: Moment) -> BySeed:
    """Hits in percent of the frames in which the hand could be seen, pooled over windows, by seed."""
    phase, first, last = moment
    hits, ceilings = (result.values(name, column, phase) for column in ("hits_per_window", "ceiling_per_window"))
    return {
        seed: 100 * sum(hits[seed][first:last]) / (WINDOW * sum(ceilings[seed][first:last]))
        for seed in hits.keys() & ceilings.keys()
        if len(hits[seed]) >= last
    }


def text(found: Interval, form: str) -> str:
    """A mean and its 95 % interval, as far as there are seeds for one."""
    if found.mean is None:
        return ""
    if found.low is None or found.high is None:
        return form.format(found.mean)
    return f"{form.format(found.mean)} [{form.format(found.low)}, {form.format(found.high)}]"


def level(values: BySeed) -> str:
    """A mean over seeds with its interval."""
    return text(mean_interval([values[seed] for seed in sorted(values)], iqm=False), "{:.1f}")


def less(values: BySeed, full: BySeed) -> Interval:
    """The mean difference over the seeds that both have, with its interval where these are two or more."""
    shared = sorted(values.keys() & full.keys())
    if len(shared) > 1:
        return paired(values, full, iqm=False).interval
    return mean_interval([values[seed] - full[seed] for seed in shared], iqm=False)


def rows(head: Sequence[str], body: Sequence[Sequence[str]]) -> str:
    """A Markdown table."""
    return "\n".join(f"| {' | '.join(line)} |" for line in (head, ["---"] * len(head), *body)) + "\n"


def against_full(
    result: StudyResult, base: StudyResult, names: dict[str, str], moments: Sequence[Moment] = MOMENTS
) -> str:
    """The whole learner's levels, then what each variant has less or more on the same seeds.

    Args:
        result: where the variants stand.
        base: where the whole learner stands.
        names: what to call each condition, by its name; those without cells are left out.
        moments: of which columns there are.
    """
    full = {moment: efficiency(base, FULL, moment) for moment in moments}
    body = [["**the whole learner**", str(len(full[moments[0]])), *(level(full[moment]) for moment in moments)]]
    for name, called in names.items():
        values = {moment: efficiency(result, name, moment) for moment in moments}
        shared = values[moments[0]].keys() & full[moments[0]].keys()
        if shared:
            body.append([called, str(len(shared)), *(text(less(values[m], full[m]), "{:+.1f}") for m in moments)])
    return rows(("", "seeds", *(HEADS[MOMENTS.index(moment)] for moment in moments)), body)


# -- the blocks of the page --------------------------------------------------------------------------------------------

#: The studies with physics, what comes before the learner in the names of their conditions, and the range's name here.
RANGES = (
    ("learners-ranges", "range confined, ", "confined"),
    ("learners", "", "`paper-wide`"),
    ("learners-ranges", "range mechanical, ", "mechanical"),
)


def reached(found: Found) -> str:
    """What the learner and the paper's reach at the end of an hour with physics, by the cells of learners.md."""
    body = []
    for study, lead, called in RANGES:
        result = load_study(STUDIES / study)
        every = [efficiency(result, f"{lead}learner {learner}, damage none", END) for learner in ("best", "hebbian")]
        body.append([called, *map(level, every), " and ".join(str(len(values)) for values in every)])
    return "\n" + rows(("range of arm movements", "`best`", "the paper's learner", "seeds"), body) + "\n"


ABLATIONS = {
    "no units' fields": "no units' fields w",
    "no shared sheet": "no shared sheet f",
    "no polynomial of visibility": "no polynomial F",
    "misses teach nothing": "misses teach nothing",
    "centres the hand later": "looks at g + ε, without visibility and memory, once G has settled",
    "centres the hand": "looks at g + ε, without visibility and memory, from the first frame on",
    "no working memory": "no working memory E",
    "no units' directions": "no units' directions b",
    "no polynomial": "no polynomial B",
    "no metric": "monomials learn without the metric M",
    "as if no arm moved": "G is learned as if no arm moved the hand",
    "coarse map": "the map measures distances by the limits of the joints",
    "never slows down": "directions go on learning as fast as at first",
    "no drift": "no drift ε",
    "no schema": "no schema",
    "never forgets": "trusts the schema for as long as a surprise lasts, and forgets nothing",
    "no anticipation": "no anticipation",
    "no gate": "misses beyond the sheet teach, too",
}
PLASTIC = {
    FULL: "all parts",
    "links alone": "directions and visibility, but not the schema",
    "schema alone": "the schema, but not directions and visibility",
    "neither": "neither",
    "nothing learns": "nothing at all (calibration and memory stand still, too)",
}
LATE = {f"late by {k}": f"{k} late" for k in (1, 2, 3)} | {
    f"late by {k}, looks {k + 1} ahead": f"{k} late, {k + 1} ahead" for k in (1, 2, 3)
}
HEAD_SPEEDS = {"head 4 rad/s": "4 rad/s", "head 2 rad/s": "2 rad/s"}
RATE_NAMES = {
    "plane": "polynomial of the directions, .2",
    "turns": "units' directions, .5",
    "sheet": "shared sheet, .1",
    "fields": "units' fields, .6",
    "step": "the schema's step, .1",
    "strokes": "strokes in the working memory, 3",
}
FACTORS = {"0.5": "halved", "2": "doubled"}


def parts(found: Found) -> str:
    """What the learner loses without each part, in both ranges."""
    said = ["\nIn the mechanical range:\n\n" + against_full(found[PARTS], found[PARTS], ABLATIONS)]
    if WIDE in found:
        said.append("\nIn the range of `paper-wide`:\n\n" + against_full(found[WIDE], found[WIDE], ABLATIONS))
    return "".join(said) + "\n"


def plastic(found: Found) -> str:
    """What may learn after the damage."""
    ranges = [(name, called) for name, called in ((PARTS, "mechanical"), (WIDE, "`paper-wide`")) if name in found]
    moments = (FIRST_AFTER, REST_AFTER)
    body = []
    for name, called in PLASTIC.items():
        cells = [level(efficiency(found[study], name, moment)) for study, _ in ranges for moment in moments]
        if any(cells):
            body.append([called, *cells])
    head = [f"{called}: minutes {minutes}" for _, called in ranges for minutes in ("0 to 5", "5 to 15")]
    return "\n" + rows(("what learns after the damage", *head), body) + f"\n{seeds_of(found, [n for n, _ in ranges])}\n"


def lasting(found: Found) -> str:
    """What forgetting is worth after damages that no shift explains."""
    moments, body = (FIRST_AFTER, REST_AFTER), []
    for study, called in ((PARTS, "mechanical"), (WIDE, "`paper-wide`")):
        for damage in ("permuted", "swapped") if study in found else ():
            pairs = [
                [efficiency(found[study], name, moment) for name in (damage, f"{damage}, never forgets")]
                for moment in moments
            ]
            cells = [cell for does, never in pairs for cell in (level(does), text(less(does, never), "{:+.1f}"))]
            if any(cells):
                body.append([f"{called}, {damage}", str(len(pairs[0][0])), *cells])
    head = [name for minutes in ("0 to 5", "5 to 15") for name in (f"minutes {minutes}", "more than without step 8")]
    return "\n" + rows(("", "seeds", *head), body) + "\n"


def undone(found: Found) -> str:
    """What comes back once a damage is undone, with what was known before it and without."""
    body = []
    for study, called in ((PARTS, "mechanical"), (WIDE, "`paper-wide`")):
        for damage in ("permuted", "swapped") if study in found else ():
            names = (f"{damage}, undone", f"{damage}, undone, keeps nothing")
            shares, waits = ([found[study].values(name, c, 2) for name in names] for c in MEASURES_UNDONE)
            if shares[0]:
                cells = [cell for share, wait in zip(shares, waits, strict=True) for cell in back(share, wait)]
                body.append([f"{called}, {damage}", str(len(shares[0])), *cells])
    head = [f"{one}{without}" for without in ("", " without step 9") for one in ("first minute, %", "back within one")]
    return "\n" + rows(("", "seeds", *head), body) + "\n"


#: Columns of the table of cells: the first minute as a share of the level before, and minutes to 95 % of that.
MEASURES_UNDONE = ("retention", "retention_minutes")


def back(shares: BySeed, waits: BySeed) -> tuple[str, str]:
    """The share of the level before that is back in the first minute, and in how many runs 95 % of it are."""
    soon = sum(wait <= 1 for wait in waits.values())
    return level({seed: 100 * share for seed, share in shares.items()}), f"{soon} of {len(shares)}"


#: What is looked at, the conditions of the usual rates and of slow ones, and when.
SLOW = (
    ("before the damage, minutes 5 to 10", FULL, "learns slowly", SECOND),
    ("before the damage, minutes 45 to 60", FULL, "learns slowly", END),
    ("the paper's damage, minutes 5 to 15", FULL, "learns slowly", REST_AFTER),
    ("`dead-joint-1`, minutes 5 to 15", "dead joint 1", "dead joint 1, learns slowly", REST_AFTER),
    ("`dead-joint-2`, minutes 5 to 15", "dead joint 2", "dead joint 2, learns slowly", REST_AFTER),
)


def dead(found: Found) -> str:
    """What slower rates would be worth where a joint is dead, and elsewhere."""
    body = []
    for called, usual, slow, moment in SLOW:
        usually, slowly = (efficiency(found[PARTS], name, moment) for name in (usual, slow))
        body.append([called, str(len(usually)), level(usually), text(less(slowly, usually), "{:+.1f}")])
    return "\n" + rows(("mechanical range", "seeds", "`best`", "more with rates times .3"), body) + "\n"


def seeds_of(found: Found, studies: Sequence[str]) -> str:
    """How many seeds the least and the best known of these cells have."""
    counts = [len(efficiency(found[study], name, FIRST_AFTER)) for study in studies for name in PLASTIC]
    known = sorted({count for count in counts if count})
    return f"Seeds: {known[0]}.\n" if len(known) == 1 else f"Seeds: {known[0]} to {known[-1]}.\n"


def rates(found: Found) -> str:
    """Each rate halved and doubled."""
    names = ((name, called, *factor) for name, called in RATE_NAMES.items() for factor in FACTORS.items())
    return of_rates(found, {f"{name} x {factor}": f"{called}: {word}" for name, called, factor, word in names})


def late(found: Found) -> str:
    """Late senses."""
    return of_rates(found, LATE)


def heads(found: Found) -> str:
    """Slow heads."""
    return of_rates(found, HEAD_SPEEDS)


def of_rates(found: Found, names: dict[str, str]) -> str:
    """Conditions of the third study beside the whole learner of the first."""
    if RATES not in found or not any(efficiency(found[RATES], name, SECOND) for name in names):
        return "\nNot measured yet: `python docs/make_best.py --run` does.\n\n"
    return "\n" + against_full(found[RATES], found[PARTS], names) + "\n"


def lacks(found: Found) -> str:
    """What adaptation needs, each sentence with its number."""
    said = [sentence for one in SENTENCES if (sentence := one(found[PARTS]))]
    return "\n" + "\n".join(f"- {sentence}" for sentence in said) + "\n\n"


def missing(lead: str, name: str, moment: Moment, when: str) -> Callable[[StudyResult], str]:
    """A sentence on what a variant reaches, and how far that is from the whole learner on the same seeds."""

    def sentence(result: StudyResult) -> str:
        values, full = efficiency(result, name, moment), efficiency(result, FULL, moment)
        return apart(lead, values, full, when, "the whole learner") if values.keys() & full.keys() else ""

    return sentence


def beside(lead: str, name: str, other: str, called: str, moment: Moment, when: str) -> Callable[[StudyResult], str]:
    """The same beside another variant."""

    def sentence(result: StudyResult) -> str:
        values, others = efficiency(result, name, moment), efficiency(result, other, moment)
        return apart(lead, values, others, when, called) if values.keys() & others.keys() else ""

    return sentence


def apart(lead: str, values: BySeed, others: BySeed, when: str, called: str) -> str:
    """A sentence on two means over the same seeds; it says so where the seeds cannot tell them apart."""
    shared = sorted(values.keys() & others.keys())
    found = less(values, others)
    assert found.mean is not None
    own, other = (mean_interval([each[seed] for seed in shared], iqm=False).mean for each in (values, others))
    side, sign = ("below", -1) if found.mean < 0 else ("above", 1)
    bounds, unsure = "", ""
    if found.low is not None and found.high is not None:
        ends = sorted((abs(found.low), abs(found.high)))
        bounds = f" [{ends[0]:.1f}, {ends[1]:.1f}]"
        if found.low <= 0 <= found.high:
            ends = sorted((sign * found.low, sign * found.high))
            bounds = f" [{ends[0]:+.1f}, {ends[1]:+.1f}]"
            unsure = " These seeds cannot tell that from no difference."
    many = f"{len(shared)} seeds" if len(shared) > 1 else "one seed"
    return (
        f"{lead}: {own:.1f} percent {when}, {abs(found.mean):.1f} points{bounds} {side} {called} ({other:.1f}; {many})."
        f"{unsure}"
    )


HOUR, EARLY, AFTER = "in minutes 45 to 60", "in the first five minutes after the damage", "in minutes 5 to 15 after it"
SENTENCES = (
    missing("**Misses.** If visibility learns from hits alone", "misses teach nothing", END, HOUR),
    beside(
        "The paper's own learner with the delta rule on its links, by which a miss teaches",
        "delta",
        "the paper's",
        "the paper's learner",
        END,
        HOUR,
    ),
    missing("**The rule itself.** The paper's learner", "the paper's", END, HOUR),
    missing(
        "**Directions alone.** If it forgets visibility and memory, and looks at g + eps, once G has settled",
        "centres the hand later",
        END,
        HOUR,
    ),
    missing(
        "If it knows no visibility and looks at g + eps from its first frame on",
        "centres the hand",
        SECOND,
        "in minutes 5 to 10",
    ),
    missing("**What postures share.** Without the shared sheet", "no shared sheet", SECOND, "in minutes 5 to 10"),
    missing("At the end of the hour, without it", "no shared sheet", END, HOUR),
    missing("**What is their own.** Without the units' fields", "no units' fields", END, HOUR),
    missing("**Far misses.** If misses far beyond the sheet teach visibility, too", "no gate", END, HOUR),
    missing("**The last seconds.** Without the working memory", "no working memory", FIRST_AFTER, EARLY),
    missing("**After the damage.** If all learns but the schema", "links alone", FIRST_AFTER, EARLY),
    missing("Likewise", "links alone", REST_AFTER, AFTER),
    missing("If the schema learns, but directions and visibility do not", "schema alone", FIRST_AFTER, EARLY),
    missing("Likewise", "schema alone", REST_AFTER, AFTER),
    missing("If neither does", "neither", REST_AFTER, AFTER),
    missing("If nothing learns at all", "nothing learns", REST_AFTER, AFTER),
    missing("The paper's learner, all of whose parts go on learning", "the paper's", REST_AFTER, AFTER),
    beside("The same with the delta rule", "delta", "the paper's", "the paper's learner", REST_AFTER, AFTER),
)


def cost(found: Found) -> str:
    """How much of what is planned has been run, and what that took."""
    done = {name: len(set(result.table["key"].to_pylist())) for name, result in found.items()}
    counts = ", ".join(f"{done.get(name, 0)} of {planned_cells(name)} of `studies/{name}.toml`" for name in NAMES)
    spent = {key: s for one in found.values() for key, s in zip(*columns(one, "key", "cpu_s"), strict=True)}
    return f"\nCells that have been run: {counts}. They took {sum(spent.values()) / 60:.1f} minutes of a processor.\n\n"


def planned_cells(name: str) -> int:
    """Pairs of condition and seed in a study file."""
    plan = tomllib.loads((STUDIES / f"{name}.toml").read_text(encoding="utf-8"))
    return sum(len(condition.get("seeds", range(plan["seeds"]))) for condition in plan["conditions"])


def columns(result: StudyResult, *names: str) -> list[list[float]]:
    return [result.table[name].to_pylist() for name in names]


BLOCKS: dict[str, Callable[[Found], str]] = {
    "reached": reached,
    "parts": parts,
    "plastic": plastic,
    "lasting": lasting,
    "undone": undone,
    "dead": dead,
    "rates": rates,
    "late": late,
    "heads": heads,
    "lacks": lacks,
    "cost": cost,
}


def page(found: Found, written: str) -> str:
    """The page with its tables made anew."""
    return BLOCK.sub(lambda match: match[1] + BLOCKS[match[2]](found) + match[3], written)


def main() -> None:
    """Run what is not finished if asked for, then write the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", action="store_true", help="go on with the studies first")
    if parser.parse_args().run:
        run()
    PAGE.write_text(page(tables(), PAGE.read_text(encoding="utf-8")), encoding="utf-8")
    print(PAGE, file=sys.stderr)


if __name__ == "__main__":
    main()
