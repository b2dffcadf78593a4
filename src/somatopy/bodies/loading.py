"""Reads and compiles the file of a model, and checks that it has what an anatomy names."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any

import mujoco

from somatopy.bodies.anatomy import Anatomy
from somatopy.bodies.base import BodyError
from somatopy.bodies.foreign import check_names, said

__all__ = ["available", "compiled", "parse", "require"]


def parse(path: Path) -> mujoco.MjSpec:
    """The spec in a file, MJCF or URDF.

    Raises:
        BodyError: the file is missing, or MuJoCo cannot read it.
    """
    if path.is_dir():
        raise BodyError(f"The model {path} is a folder. Name the file in it, MJCF (.xml) or URDF (.urdf).")
    if not os.path.isfile(path):
        raise BodyError(f"The model {path} does not exist.")
    if path.suffix.lower() == ".mjb":
        raise BodyError(
            f"The model {path} is compiled (.mjb), so that nothing can be added to it any more. Name the MJCF (.xml) "
            "or URDF (.urdf) that it was made from."
        )
    try:
        spec = mujoco.MjSpec.from_file(str(path))
    except ValueError as error:
        raise BodyError(f"MuJoCo cannot read the model {path}: {said(error, path)}") from error
    check_names(spec, path)
    for mesh in spec.meshes:
        mesh.file = _in_package(mesh.file, path)
    if _is_urdf(path):
        _free_first_links(spec)
    return spec


def _is_urdf(path: Path) -> bool:
    """Whether the root of a file that MuJoCo has read is <robot>. By this, not by the suffix, MuJoCo knows a URDF."""
    text = re.sub(rb"<!--.*?-->", b"", path.read_bytes(), flags=re.DOTALL)
    root = re.search(rb"<([A-Za-z]\w*)", text)
    return root is not None and root[1].lower() == b"robot"


def _free_first_links(spec: mujoco.MjSpec) -> None:
    """Let the first link that moves pass through what carries it, as each later link does.

    MuJoCo lets no body touch its parent, except where the parent stands fixed. URDF has no word to forbid this contact,
    and the shapes of neighbours overlap in most files.
    """
    still: list[mujoco.MjsBody] = []
    first: list[mujoco.MjsBody] = []
    ahead = list(spec.worldbody.bodies)
    while ahead:
        body = ahead.pop()
        (first if body.joints else still).append(body)
        ahead += [] if body.joints else body.bodies
    for body, base in product(first, still):
        spec.add_exclude(bodyname1=base.name, bodyname2=body.name)


def _in_package(file: str, model: Path) -> str:
    """Where a mesh is that a URDF names as `package://NAME/FILE`, which ROS knows and MuJoCo does not.

    NAME is the folder that has FILE: one above the model, whatever it is called, or one beside those.
    """
    if not file.startswith("package:"):
        return file
    name, _, rest = file.removeprefix("package:").lstrip("/").partition("/")
    above = model.resolve().parents
    places = [*(folder / name / rest for folder in above), *(folder / rest for folder in above)]
    return next((str(place) for place in places if rest and place.is_file()), file)


def compiled(spec: mujoco.MjSpec, path: Path) -> mujoco.MjModel:
    """Compile a copy of a spec.

    The spec itself is not compiled, since MuJoCo removes parts from a compiled spec 20 times more slowly.

    Raises:
        BodyError: MuJoCo cannot compile it.
    """
    try:
        return spec.copy().compile()
    except ValueError as error:
        raise BodyError(f"MuJoCo cannot compile the model {path}: {said(error, path)}") from error


def require(spec: mujoco.MjSpec, anatomy: Anatomy, kind: str, names: Sequence[str]) -> None:
    """Check that a spec has a joint, camera, body or keyframe of each name.

    Args:
        spec: the spec.
        anatomy: the anatomy that gives the names, for the message.
        kind: "joint", "camera", "body" or "keyframe".
        names: the names.

    Raises:
        BodyError: one does not exist. The message lists those that do.
    """
    parts = {"joint": spec.joints, "camera": spec.cameras, "body": spec.bodies, "keyframe": spec.keys}[kind]
    there = [part.name for part in parts]
    for name in names:
        if not name or name not in there:
            raise BodyError(
                f"The {kind} {name!r} does not exist in {anatomy.model}. Available: {available(kind, parts)}."
            )


def available(kind: str, parts: Sequence[Any]) -> str:
    """The names of a spec's parts, for a message.

    If some have no name, the text says how many, in which bodies, and how to name them.
    """
    named = ", ".join(part.name for part in parts if part.name)
    nameless = [part for part in parts if not part.name]
    if not nameless:
        return named or "none"
    on = [part.parent.name for part in nameless] if kind in ("joint", "camera") else []
    where = sorted({repr(body) if body else "a body without a name" for body in on})
    count = f"an unnamed {kind}" if len(nameless) == 1 else f"{len(nameless)} unnamed {kind}s"
    place = f" (on {', '.join(where)})" if where else ""
    return f'{f"{named}, and " if named else ""}{count}{place}; to use one, give it name="..." in the model'
