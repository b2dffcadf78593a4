"""The anatomy file, which says which joints are arm and head, which camera is the eye, and where the marker sits."""

from __future__ import annotations

import tomllib
from importlib.util import find_spec
from pathlib import Path
from typing import Self

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
    Servo,
    Table,
)

__all__ = ["MODELS", "Add", "Anatomy", "Coupling", "Servo", "anatomy_path"]

#: Robots that come with somatopy: name -> anatomy file.
MODELS = {"nao": Path(__file__).parent / "nao" / "anatomy.toml"}


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
    home: str | None = None
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
            table = tomllib.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise BodyError(f"Cannot read the anatomy file {path}: {error.strerror}.") from error
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise BodyError(f"The anatomy file {path} is not valid TOML: {error}.") from error
        try:
            anatomy = cls.model_validate(table)
        except ValidationError as error:
            lines = (f"{'.'.join(map(str, e['loc'])) or 'file'}: {e['msg']}" for e in error.errors())
            raise BodyError(
                f"The anatomy file {path} does not fit: {'; '.join(lines)}. Keys: {', '.join(cls.model_fields)}."
            ) from error
        folders = [path.parent] if anatomy.package is None else _folders(anatomy.package, path)
        models = [folder / anatomy.model for folder in folders]
        return anatomy.model_copy(update={"model": next((model for model in models if model.is_file()), models[0])})


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
    if Path(body).is_file():
        return Path(body)
    raise BodyError(f"Body {body!r} is neither a known body nor an anatomy file. Known bodies: {', '.join(MODELS)}.")
