"""What somatopy check-body says: what was found, whether the hand is seen, what is wrong, and what to type next."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np
from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from somatopy.bodies import Anatomy
from somatopy.bodies.survey import CameraFacts, Chain, Survey
from somatopy.experiment.checkup import Checkup

__all__ = ["Examined", "plain", "say"]

_WIDTH, _SHOWN = 100, 5
#: What makes a run short, and spares it OpenGL.
_SHORT = "--eye geometric --minutes 20 --damage-minutes 10"


@dataclass(frozen=True)
class Examined:
    """What was found of a robot.

    Attributes:
        robot: how the user named it.
        model: its model's file.
        found: what the model has; None if it cannot be read.
        anatomy: the anatomy that was tried.
        text: the same as a file, if it was proposed.
        result: what came of it.
    """

    robot: str
    model: Path
    found: Survey | None
    anatomy: Anatomy | None
    text: str | None
    result: Checkup


def say(examined: Examined, stream: IO[str]) -> None:
    """Print all that was found, in at most 100 columns."""
    console = Console(file=stream, highlight=False, soft_wrap=False)
    console.width = min(console.width, _WIDTH) if console.is_terminal else _WIDTH
    for part in _parts(examined):
        console.print(part)
    for line in _next(examined):
        console.print(line, soft_wrap=True)


def plain(examined: Examined) -> dict[str, Any]:
    """The same as one plain object."""
    result, found = examined.result, examined.result.outlook
    sight = None
    if found is not None and result.arms is not None:
        head = found.fixed_head.tolist()
        sight = {
            "range": "confined",
            "postures": len(result.arms),
            "rate": found.rate,
            "fixed_rate": found.fixed_rate,
            "fixed_head": head,
        }
    physics = None
    if (tried := result.trial) is not None:
        errors = {name: _number(error) for name, error in zip(tried.joints, tried.errors, strict=True)}
        physics = {
            "frames": tried.frames,
            "diverged": tried.diverged,
            "errors": errors,
            "seconds_per_frame": _number(tried.seconds),
        }
    return {
        "robot": examined.robot,
        "model": str(examined.model),
        "runs": result.runs,
        "command": _command(examined) if result.runs else None,
        "faults": [asdict(fault) for fault in result.faults],
        "found": asdict(examined.found) if examined.found else None,
        "sight": sight,
        "physics": physics,
        "proposal": examined.text,
    }


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _parts(examined: Examined) -> Iterator[Any]:
    if examined.found is not None:
        yield from _model(examined.model, examined.found)
        chosen = examined.anatomy
        yield from _arms(examined.found, chosen)
        yield from _heads(examined.found, chosen)
        yield from _cameras(examined.found, chosen)
        yield from _marker(examined.found, chosen)
        yield from _lacking(examined.found)
    yield from _sight(examined.result)
    yield from _physics(examined.result)
    yield from _faults(examined.result)
    yield from _verdict(examined)


# -- what the model has ------------------------------------------------------------------------------------------------


def _model(path: Path, found: Survey) -> Iterator[Text]:
    counts = (
        _count(found.bodies, "body", "bodies"),
        _count(len(found.joints), "joint"),
        _count(len(found.cameras), "camera"),
        _count(len(found.keyframes), "keyframe") + (f" ({', '.join(found.keyframes[:4])})" if found.keyframes else ""),
    )
    yield Text.assemble((path.name, "bold"), f"  {found.name or 'a model without name'}: {', '.join(counts)}")


def _count(number: int, one: str, more: str = "") -> str:
    return f"{number or 'no'} {one if number == 1 else more or one + 's'}"


def _listed(title: str, columns: Sequence[str], rows: Iterable[Sequence[str]]) -> Iterator[Any]:
    """A title, and under it rows in columns."""
    table = Table(box=None, show_header=True, header_style="dim", padding=(0, 2, 0, 0), pad_edge=False)
    for column in columns:
        table.add_column(column, no_wrap=not column.startswith("joints"), overflow="ellipsis")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    yield Text()
    yield Text(title, style="bold")
    yield Padding(table, (0, 0, 0, 2))


def _ends(names: Sequence[str]) -> str:
    return ", ".join(names) if len(names) < 3 else f"{names[0]} ... {names[-1]}"


def _arms(found: Survey, chosen: Anatomy | None) -> Iterator[Any]:
    if not found.arms:
        return
    rows = [_arm(found, chain, chosen) for chain in found.arms[:_SHOWN]]
    columns = ("joints from base to tip", "", "reach", "servos", "ends in", "")
    yield from _listed("Could be the arm, the likeliest first", columns, rows)
    if len(found.arms) > _SHOWN:
        yield Text(f"  and {len(found.arms) - _SHOWN} more, shorter or less likely", style="dim")


def _arm(found: Survey, chain: Chain, chosen: Anatomy | None) -> tuple[str, ...]:
    servos = sum(found.joint(name).servo for name in chain.joints)
    taken = chosen is not None and set(chosen.arm.joints) <= set(chain.joints)
    length = f"{chain.reach:.2f} m" if chain.reach < 100 else f"{chain.reach:.0f} m"
    tip, count = chain.tip or "a body without name", len(chain.joints)
    return _ends(chain.joints), str(count), length, f"{servos} of {count}", tip, "<- taken" if taken else ""


def _heads(found: Survey, chosen: Anatomy | None) -> Iterator[Any]:
    rows = []
    for head in found.heads[:_SHOWN]:
        taken = chosen is not None and set(chosen.head.joints) <= set(head.joints) and _looks(chosen, head.camera)
        rows.append((_ends(head.joints), head.body, head.camera or "no camera", "<- taken" if taken else ""))
    if rows:
        yield from _listed("Could be the head", ("joints", "body", "camera", ""), rows)
    if chosen is not None and not set(chosen.head.joints) & {joint.name for joint in found.joints}:
        yield Text()
        reason = "None of these sees the hand, so that a" if rows else "No joints carry a camera of their own: a"
        yield Text(f"{reason} pan-tilt neck with a camera is added.")


def _looks(chosen: Anatomy, camera: str) -> bool:
    return camera in ("", chosen.camera.name)


def _cameras(found: Survey, chosen: Anatomy | None) -> Iterator[Any]:
    rows = [
        (camera.name or "without name", f"{camera.fovy:g} deg", camera.body, _moved(camera, chosen))
        for camera in found.cameras[:_SHOWN]
    ]
    if rows:
        yield from _listed("Cameras", ("name", "field of view", "on body", "moved by"), rows)
    if len(found.cameras) > _SHOWN:
        yield Text(f"  and {len(found.cameras) - _SHOWN} more", style="dim")


def _moved(camera: CameraFacts, chosen: Anatomy | None) -> str:
    if camera.follows:
        return "itself: it follows a body, and is no eye"
    if not camera.moved_by:
        return "nothing"
    for part, group in (("the arm", chosen.arm), ("the head", chosen.head)) if chosen else ():
        if set(group.joints) & set(camera.moved_by):
            return part
    return _ends(camera.moved_by)


def _marker(found: Survey, chosen: Anatomy | None) -> Iterator[Any]:
    arm = next((c for c in found.arms if chosen and set(chosen.arm.joints) & set(c.joints)), None)
    if arm is None or chosen is None:
        return
    others = [name for name in arm.tips if name != chosen.marker.body][:6]
    also = f" (possible too: {', '.join(others)})" if others else ""
    yield Text()
    yield _labelled("Marker", f"on {chosen.marker.body}{also}")


def _lacking(found: Survey) -> Iterator[Any]:
    """Servos, and what some joints do not have."""
    joints = found.one_dof
    served = [joint for joint in joints if joint.servo]
    yield _labelled("Servos", f"{len(served)} of {len(joints)} hinges and slides have a position servo")
    unlimited = [joint.name or f"that of {joint.body}" for joint in joints if joint.limits is None]
    unnamed = sum(not joint.name for joint in joints)
    loose = [joint.name or f"that of {joint.body}" for joint in found.joints if joint.kind in ("free", "ball")]
    facts = (
        f"without limits: {_some(unlimited)}" if unlimited else "",
        f"without name: {unnamed}" if unnamed else "",
        f"free or ball joints: {_some(loose)}" if loose else "",
    )
    if any(facts):
        yield _labelled("Joints", "; ".join(filter(None, facts)))


def _labelled(label: str, text: str, style: str = "bold") -> Table:
    """A text behind its label, all its lines indented alike."""
    table = Table.grid(padding=(0, 1, 0, 0))
    table.add_column(width=8)
    table.add_column(overflow="fold")
    table.add_row(Text(label, style=style), Text(text))
    return table


def _some(names: Sequence[str]) -> str:
    return ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")


# -- what it does ------------------------------------------------------------------------------------------------------


def _sight(result: Checkup) -> Iterator[Any]:
    found = result.outlook
    if found is None or result.arms is None:
        return
    head = ", ".join(f"{angle:.2f}" for angle in found.fixed_head)
    yield Text()
    yield _labelled(
        "Sight",
        f"The hand can be seen in {found.rate:.0%} of {len(result.arms)} arm postures of the babbling range "
        f"'confined'; the best fixed head, at ({head}) rad, sees it in {found.fixed_rate:.0%}.",
    )


def _physics(result: Checkup) -> Iterator[Any]:
    tried = result.trial
    if tried is None or tried.diverged is not None:
        return
    worst = int(np.argmax(tried.errors))
    yield _labelled(
        "Physics",
        f"{tried.frames} frames are stable. Servos come to rest within {max(tried.errors[worst], 0.001):.2g} rad "
        f"(slides: m) of their targets, {tried.joints[worst]} the farthest. A frame takes {1e3 * tried.seconds:.2g} "
        "ms, eye and learning apart.",
    )


def _faults(result: Checkup) -> Iterator[Any]:
    for fault in sorted(result.faults, key=lambda fault: not fault.stops):
        yield Text()
        yield _labelled(*(("Wrong", fault.text, "bold red") if fault.stops else ("Note", fault.text)))


def _verdict(examined: Examined) -> Iterator[Text]:
    yield Text()
    if not examined.result.runs:
        yield Text("This robot cannot run yet.", style="bold red")
        return
    yield Text("This robot can run. Type:", style="bold green")


def _next(examined: Examined) -> list[str]:
    """The shell's lines that run this robot; they are not broken, so that they can be copied."""
    if not examined.result.runs:
        return []
    proposing = f"  somatopy check-body {shlex.quote(examined.robot)} --propose > my.toml"
    return [*([proposing] if examined.text is not None else []), f"  {_command(examined)}"]


def _command(examined: Examined) -> str:
    """The shell's line that runs this robot, once what was proposed is in my.toml."""
    result = examined.result
    file = "my.toml" if examined.text is not None else examined.robot
    run = "run paper" if file == "nao" else f"run best --body.model {shlex.quote(file)} {_SHORT}"
    still = result.trial is None or result.trial.diverged is not None
    return f"somatopy {run}{' --motion kinematic' if still else ''}"
