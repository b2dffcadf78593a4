"""Pictures of a run, drawn anew from the recorded postures: the robot from outside, and what its eye saw."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Self

from numpy.typing import ArrayLike

from somatopy.bodies import BodyError, MujocoBody
from somatopy.bodies.outside import OUTSIDE, Onlooker, Standpoint, standpoint
from somatopy.contract import Intervention, Posable
from somatopy.experiment.building import built
from somatopy.experiment.context import Context, stream
from somatopy.experiment.description import NO_DAMAGE, Description, validated
from somatopy.experiment.phases import PhaseInterventions, Place
from somatopy.eyes import FiducialEye
from somatopy.percept import Floats, Image
from somatopy.registry import BODIES, Settings

__all__ = ["Photograph", "Replay", "Still", "photographs", "posed"]


@dataclass(frozen=True)
class Photograph:
    """A picture and what the detector found in it.

    Attributes:
        image: RGB, shape (height, width, 3).
        tags: corners of each tag, (4, 2) px, by its id.
        pixel: the hand's centre (u, v), px, or None on a miss.
    """

    image: Image
    tags: dict[int, Floats]
    pixel: tuple[float, float] | None


def photographs(
    body: Settings | Mapping[str, Any], arms: Sequence[ArrayLike], heads: Sequence[ArrayLike]
) -> list[Photograph]:
    """Draw what the robot's eye sees in some postures.

    Args:
        body: the settings of the body in a description.
        arms: arm postures, each (n_arm,), rad.
        heads: head postures, each (n_head,), rad.

    Raises:
        BodyError: the robot cannot be put into a posture at once.
    """
    taken = []
    with posed(body) as robot:
        eye = FiducialEye(robot.camera, robot.marker, skip=False)
        for arm, head in zip(arms, heads, strict=True):
            seen = eye.look(robot.place(arm, head))
            image = robot.picture()
            taken.append(Photograph(image, eye.detect(image), seen.pixel if seen else None))
    return taken


@contextmanager
def posed(body: Settings | Mapping[str, Any]) -> Iterator[Any]:
    """A robot without physics, which can be put into postures. It is closed when the context ends.

    Args:
        body: the settings of the body in a description.

    Raises:
        BodyError: it cannot be put into a posture at once.
    """
    settings = BODIES.validated(body)
    if hasattr(settings, "motion"):
        settings = settings.replaced(motion="kinematic")
    robot = settings.build(Context(Description()))
    try:
        if not isinstance(robot, Posable):
            raise BodyError(
                f"The body {settings.kind!r} cannot be put into postures at once: it has no place(). So its runs can "
                "be neither filmed nor drawn (somatopy.contract.Posable)."
            )
        yield robot
    finally:
        robot.close()


# -- a run, frame by frame ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Still:
    """What one frame of a run looked like.

    Attributes:
        outside: the robot from outside, as a camera in the room sees it, RGB, shape (height, width, 3).
        eye: where the robot's eye is in that picture, (u, v) px; None if the model's own camera took it.
        inside: what the eye sees, RGB, shape (height, width, 3).
        tags: corners of each tag that the detector finds in it, (4, 2) px, by its id.
    """

    outside: Image
    eye: Floats | None
    inside: Image
    tags: dict[int, Floats]


class Replay:
    """The robot of a run, put into the recorded postures again, with the damages of each phase.

    It does not need physics, babbler, eye and learner of the run. Interventions change the body again. Their other
    effects cannot be seen in pictures. The model's camera named `outside` takes the pictures from outside. A model
    without such a camera gets one by `surround`.

    Args:
        table: the experiment, as it stands in its experiment.toml.
        size: width and height of the pictures from outside, px.

    Attributes:
        robot: the robot, which this class moves.

    Raises:
        DescriptionError: body or interventions cannot be made from the table.
        BodyError: the robot cannot be put into a posture at once, or is no MuJoCo model.

    Example:
        >>> from somatopy import paper
        >>> with Replay(paper().model_dump(mode="json")) as replay:
        ...     replay.robot.arm.names[0]
        'LShoulderPitch'
    """

    def __init__(self, table: Mapping[str, Any], size: tuple[int, int] = (480, 480)) -> None:
        told = {key: table[key] for key in ("seed", "body", "babbling", "phases") if key in table}
        self._description, self._size = validated(told, "The experiment of this run"), size
        self._closing = ExitStack()
        with ExitStack() as opened:
            self.robot = _mujoco(opened.enter_context(posed(self._description.body)), self._description)
            self._closing = opened.pop_all()
        self._eye = FiducialEye(self.robot.camera, self.robot.marker, skip=False)
        self._at: Standpoint | None = None
        self._phase, self._during = -1, ExitStack()

    def surround(self, postures: Iterable[tuple[ArrayLike, ArrayLike]]) -> None:
        """Put a camera into the room that sees the robot in these postures. If the model has one, nothing happens.

        Args:
            postures: at least one pair of an arm posture, (n_arm,), and a head posture, (n_head,), rad, slides m.
        """
        if OUTSIDE not in [self.robot.model.camera(k).name for k in range(self.robot.model.ncam)]:
            self._at = standpoint(self.robot, postures)

    def still(self, phase: int, arm: ArrayLike, head: ArrayLike) -> Still:
        """Draw one frame.

        Args:
            phase: index of its phase.
            arm: arm posture, (n_arm,), rad, slides m.
            head: head posture, (n_head,), rad, slides m.

        Raises:
            NoGL: no OpenGL works here.
            KeyError: the model has no camera of its own, and none has been put up.
        """
        if phase != self._phase:
            self._enter(phase)
        view = self.robot.place(arm, head).view
        inside, outside = self.robot.picture(), self._onlooker.picture(arm, head)
        ring = None if self._at is None or view is None else self._onlooker.pixel(view.camera[:3])
        return Still(outside, ring, inside, self._eye.detect(inside))

    def _enter(self, phase: int) -> None:
        self._during.close()
        with ExitStack() as entered:
            entered.enter_context(self._injured(phase))
            self._onlooker = entered.enter_context(closing(Onlooker(self.robot, self._at, self._size)))
            self._during, self._phase = entered.pop_all(), phase

    @contextmanager
    def _injured(self, phase: int) -> Iterator[None]:
        """The robot as the interventions of a phase hold it."""
        owner: Any = SimpleNamespace(body=self.robot, learner=None)
        places = []
        for number, settings in enumerate(self._description.phases[phase].interventions):
            if settings.kind in NO_DAMAGE:
                continue
            name = f"phase {phase} intervention {number}"
            seed = self._description.seed
            context = Context(self._description, self.robot, stream(seed, name), self.robot.reset(seed).arm)
            done = built(f"phases.{phase}", Intervention, settings, context)
            if done.alters_ceiling:  # of all interventions, these change the body
                places.append(Place(owner, done, stream(seed, name), ""))
        interventions = PhaseInterventions(places)
        interventions.hold()
        try:
            yield
        finally:
            interventions.release()

    def close(self) -> None:
        """Undo damages, and free the memory of the pictures. A second call does nothing."""
        self._during.close()
        self._closing.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _mujoco(robot: Any, description: Description) -> MujocoBody:
    if not isinstance(robot, MujocoBody):
        raise BodyError(
            f"The body {description.body.kind!r} cannot be filmed: films are drawn of robots with a MuJoCo model."
        )
    return robot
