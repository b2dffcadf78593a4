"""The anatomy file, which says which joints are arm and head, which camera is the eye, and where the marker sits."""

from __future__ import annotations

import os
import shlex
import tomllib
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self, get_args

from pydantic import Field, ValidationError, model_validator

from somatopy.bodies.base import BodyError
from somatopy.bodies.tables import (
    Add,
    CameraTable,
    Coupling,
    Finite,
    Head,
    Interval,
    Joints,
    MarkerTable,
    Name,
    Servo,
    Table,
)
from somatopy.validation import explain, no_toml

__all__ = ["MODELS", "Add", "Anatomy", "Coupling", "Servo", "anatomy_path"]

#: Robots that come with somatopy: name -> anatomy file.
MODELS = {"nao": Path(__file__).parent / "nao" / "anatomy.toml"}
_OF_MODELS = (".xml", ".mjcf", ".urdf")


class Anatomy(Table):
    """What the file of a model does not say: which joints, camera and body take part, and what the model lacks.

    Attributes:
        name: the robot's name.
        model: the file of its model, MJCF (.xml) or URDF (.urdf).
        home: the keyframe in which the robot starts. Without it, all joints start at their reference position.
        arm: the joints that babble. They move the body with the marker.
        head: the joints that the learner moves. They move the camera.
        camera: the camera.
        marker: the cube of tags.
        ranges: babbling ranges of the arm by name, with one [low, high] for each joint, rad.
        package: the installed Python package in whose folder `model` is. It is not imported.
        posture: start positions of single joints by name, rad (m for slides). They replace those of `home`.
        add: what is added to the model because it lacks it.
    """

    name: str
    model: Path
    home: Name | None = None
    arm: Joints
    head: Head
    camera: CameraTable
    marker: MarkerTable
    ranges: dict[str, tuple[Interval, ...]] = Field({})
    package: str | None = Field(None, repr=False, min_length=1)
    posture: dict[str, Finite] = Field({}, repr=False)
    add: Add = Field(Add(), repr=False)

    @model_validator(mode="after")
    def _apart(self) -> Self:
        both = set(self.arm.joints) & set(self.head.joints)
        if both:
            raise ValueError(f"a joint belongs to arm or head, not to both: {sorted(both)}")
        for name, intervals in self.ranges.items():
            if len(intervals) != len(self.arm.joints):
                joints = list(self.arm.joints)
                raise ValueError(f"the range {name!r} needs one [low, high] for each of {joints}, not {len(intervals)}")
        return self

    @model_validator(mode="after")
    def _added(self) -> Self:
        moving = [*self.arm.joints, *self.head.joints]
        kept = [name for name in moving if self.add.freeze != "rest" and name in self.add.freeze]
        if kept:
            raise ValueError(f"add.freeze names {kept}, which arm or head move; freeze others, or move without them")
        loose = [name for name in self.neck_joints if name not in self.head.joints]
        if loose:
            raise ValueError(f"add.neck has joints {loose} that nothing moves; name them in [head] joints too")
        return self

    @property
    def neck_joints(self) -> tuple[str, ...]:
        """Names of the joints that the added neck has."""
        return self.add.neck.joints if self.add.neck else ()

    @property
    def changes_model(self) -> bool:
        """Whether the anatomy changes the model: something is added, frozen or placed."""
        return bool(self.posture or self.arm.limits or self.head.limits) or self.add != Add()

    @classmethod
    def load(cls, path: str | Path) -> Anatomy:
        """Read an anatomy file (TOML); `model` is resolved relative to it, or to the folder of `package`.

        Raises:
            BodyError: the file is missing or does not parse, a key is unknown, missing or wrong, or the package is
                not installed.
        """
        path = Path(path)
        try:
            table = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise BodyError(f"Cannot read the anatomy file {path}: {error.strerror}.") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise BodyError(_no_toml(path, error)) from error
        try:
            anatomy = cls.model_validate(table)
        except ValidationError as error:
            raise BodyError(f"The anatomy file {path} does not fit: {explain(error, _keys)}.") from error
        folders = [path.parent] if anatomy.package is None else _folders(anatomy.package, path)
        models = [folder / anatomy.model for folder in folders]
        return anatomy.model_copy(update={"model": next(filter(os.path.isfile, models), models[0])})


def _no_toml(path: Path, error: ValueError) -> str:
    """What to say of a file that is no TOML; who names a model is told how to get the file that is meant."""
    if path.suffix.lower() not in _OF_MODELS:
        return f"The anatomy file {path} {no_toml(error)}."
    return (
        f"{path} is a robot's model. What is asked for is an anatomy file, which names the model and says what of it "
        "is arm, head, camera and hand. Write one with "
        f"`somatopy check-body {shlex.quote(str(path))} --propose > my.toml`, and name my.toml instead."
    )


def _keys(place: Sequence[str]) -> list[str]:
    """The valid keys of the table that stands at some keys of an anatomy file."""
    table: type[Table] = Anatomy
    for key in place:
        if field := table.model_fields.get(key):
            table = next((found for found in _classes(field.annotation) if issubclass(found, Table)), table)
    return [*table.model_fields]


def _classes(hint: Any) -> Iterator[type]:
    """All classes in a type."""
    if isinstance(hint, type):
        yield hint
    for part in get_args(hint):
        yield from _classes(part)


def _folders(package: str, path: Path) -> list[Path]:
    """Where an installed package's files are; neither it nor a part of it is imported."""
    first, *rest = package.split(".")
    found = find_spec(first) if first.isidentifier() else None
    if found is None or not found.submodule_search_locations:
        raise BodyError(
            f"The anatomy file {path} takes its model from the Python package {package!r}, which is not installed "
            f"here. Install it (`pip install {first.replace('_', '-')}`, where it bears that name there too), or copy "
            "the model beside the anatomy file and leave `package` out."
        )
    return [Path(folder, *rest) for folder in found.submodule_search_locations]


def anatomy_path(body: str) -> Path:
    """The path of an anatomy file.

    Args:
        body: the name of a body that comes with somatopy, or the path of an anatomy file.

    Raises:
        BodyError: neither a known name nor an existing file.
    """
    if body in MODELS:
        return MODELS[body]
    if os.path.isfile(body):  # false also for what no file can be called
        return Path(body)
    raise BodyError(f"Body {body!r} is neither a known body nor an anatomy file. Known bodies: {', '.join(MODELS)}.")
