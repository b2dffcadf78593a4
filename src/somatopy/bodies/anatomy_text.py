"""Writes a proposal as an anatomy file: TOML with comments."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping

from somatopy.bodies.proposal import Group, Proposal

__all__ = ["anatomy_text"]

_WIDTH = 108

Servos = Mapping[str, Mapping[str, float]]


def anatomy_text(proposal: Proposal, servos: Servos | None = None) -> str:
    """The text of an anatomy file, with comments that name other choices.

    Args:
        proposal: what the file says.
        servos: `kp`, `kv` and `force` of the position servos to add, by joint.

    Example:
        >>> from somatopy.bodies import MODELS
        >>> from somatopy.bodies.proposal import propose
        >>> from somatopy.bodies.survey import read_model, survey
        >>> model = read_model(MODELS["nao"].with_name("nao.xml"))
        >>> print("\\n".join(anatomy_text(propose(model, survey(model), "nao.xml")).splitlines()[:5]))
        # An anatomy for somatopy, proposed by `somatopy check-body`. Change what you know better.
        name = "NAO H25 V5"
        model = "nao.xml"
        home = "StandInit"                # the keyframe to start in
        <BLANKLINE>
    """
    parts = [_top(proposal), _posture(proposal), _arm(proposal), _head(proposal), _camera(proposal), _marker(proposal)]
    parts += [_ranges(proposal), _added(proposal), _neck(proposal), _added_camera(proposal), _servos(servos or {})]
    return "\n\n".join("\n".join(lines) for lines in map(list, parts) if lines) + "\n"


def _line(text: str, comment: str) -> str:
    """A line with its comment behind it, or above where that would be too long."""
    behind = f"{text:<33} # {comment}"
    return behind if len(behind) <= _WIDTH else f"# {comment[0].upper()}{comment[1:]}:\n{text}"


def _said(value: object) -> str:
    """A string, number or list as TOML has it."""
    if isinstance(value, tuple | list):
        return f"[{', '.join(map(_said, value))}]"
    return json.dumps(value, ensure_ascii=False)


def _top(proposal: Proposal) -> Iterator[str]:
    yield "# An anatomy for somatopy, proposed by `somatopy check-body`. Change what you know better."
    yield f"name = {_said(proposal.name)}"
    yield f"model = {_said(proposal.model)}"
    if proposal.home is not None:
        yield _line(f"home = {_said(proposal.home)}", "the keyframe to start in")


def _posture(proposal: Proposal) -> Iterator[str]:
    if proposal.posture:
        yield "[posture]"
        yield "# Where the robot starts, rad (slides: m), since the model has no keyframe: the middle of `confined`."
    for joint, value in proposal.posture.items():
        yield f"{_key(joint)} = {_said(value)}"


def _group(group: Group) -> Iterator[str]:
    yield f"joints = {_said(group.joints)}"
    yield _line(
        f"velocity = {_said(group.velocity)}", "limits of speed, rad/s (slides: m/s), of our choice: MuJoCo has none"
    )
    if group.limits is not None:
        yield _line(f"limits = {_said(group.limits)}", "rad (slides: m); the model lacks some")


def _arm(proposal: Proposal) -> Iterator[str]:
    yield "[arm]"
    yield from _group(proposal.arm)
    if proposal.other_arms:
        yield "# Of two arms alike the left one is taken. What else could be the arm, and where the marker is then:"
    for chain in proposal.other_arms:
        yield f"# joints = {_said(chain.joints)}, marker.body = {_said(chain.tip)}"


def _head(proposal: Proposal) -> Iterator[str]:
    yield "[head]"
    if proposal.neck is not None:
        yield "# The model has no head that suits: the neck under [add.neck] is put in."
    yield from _group(proposal.head)


def _camera(proposal: Proposal) -> Iterator[str]:
    eye = proposal.eye
    yield "[camera]"
    yield f"name = {_said(eye.name)}"
    yield _line(f"width = {eye.width}", "px; the smallest picture that shows the tags of a far hand")
    yield f"height = {eye.height}"
    for name in proposal.other_cameras:
        yield _line(f"# name = {_said(name)}", "on the same head")


def _marker(proposal: Proposal) -> Iterator[str]:
    yield "[marker]"
    yield f"body = {_said(proposal.marker)}"
    yield _line(f"position = {_said(proposal.position)}", "m, in that body's frame: beyond all that is there")
    yield _line(f"axis = {_said(proposal.axis)}", "along the last link; tags are on the four sides around it")


def _ranges(proposal: Proposal) -> Iterator[str]:
    if proposal.ranges:
        yield "[ranges]"
        yield '# Babbling ranges, [low, high] of each arm joint. Presets babble in "confined"; "wide" may be added.'
    for name, range_ in proposal.ranges.items():
        yield f"{name} = {_said(range_)}"


def _added(proposal: Proposal) -> Iterator[str]:
    if not (proposal.floats or proposal.others):
        return
    yield "[add]"
    if proposal.floats:
        yield _line("fixed_base = true", "free and ball joints go: the robot stands where home puts it")
    if proposal.others:
        yield _line('freeze = "rest"', f"joints that are neither arm nor head stand still: {proposal.others} of them")


def _neck(proposal: Proposal) -> Iterator[str]:
    if (neck := proposal.neck) is None:
        return
    yield "[add.neck]"
    yield f"body = {_said(neck.body)}"
    yield _line(f"position = {_said(neck.position)}", "m: above the arm, with most of what it reaches in plain view")
    yield _line(f"forward = {_said(neck.forward)}", "to where the hand mostly is")
    yield f"up = {_said(neck.up)}"
    yield f"joints = {_said(proposal.head.joints)}"
    yield _line(
        f"limits = {_said(neck.limits)}", "rad: the middle of the tilt looks at the middle of the hand's places"
    )


def _added_camera(proposal: Proposal) -> Iterator[str]:
    eye = proposal.eye
    if not eye.added:
        return
    yield "[add.camera]"
    if eye.body:
        yield f"body = {_said(eye.body)}"
        yield f"position = {_said(eye.position)}"
        yield _line(f"forward = {_said(eye.forward)}", "level, to where the hand mostly is")
        yield f"up = {_said(eye.up)}"
    yield _line(f"fovy = {eye.fovy:g}", "vertical field of view, degrees")


def _servos(servos: Servos) -> Iterator[str]:
    if not servos:
        return
    yield "[add.servos]"
    yield "# Position servos, since the model has none there: N m/rad, N m s/rad and N m (slides: N/m, N s/m, N)."
    width = max(map(len, map(_key, servos)))
    for joint, gains in servos.items():
        yield f"{_key(joint):<{width}} = {{ {', '.join(_gains(gains))} }}"


def _gains(gains: Mapping[str, float]) -> Iterable[str]:
    return (f"{name} = {value:.10g}" for name, value in gains.items())


def _key(name: str) -> str:
    """A joint's name as TOML's key."""
    bare = [c.isascii() and (c.isalnum() or c in "_-") for c in name]
    return name if name and all(bare) else _said(name)
