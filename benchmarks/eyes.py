"""Speed of the geometric eye, of the test that saves pictures, and of the ceiling, beside drawing pictures and parts.

Kernel times are those of one call inside compiled code; an eye's `find` adds the way there from Python.

Example: python benchmarks/eyes.py --postures 600
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable
from itertools import pairwise
from time import perf_counter, thread_time

import numpy as np

from somatopy._jit import jit
from somatopy.bodies import MujocoBody
from somatopy.experiment.ceiling import Vantages, reachable
from somatopy.eyes import FiducialEye, GeometricEye
from somatopy.eyes.frustum import may_be_seen, optics, part_with_tags
from somatopy.eyes.geometric import see
from somatopy.percept import Floats, Ints, Part, Shapes, View

REPEATS = 300


@jit
def again(
    n: int,
    camera: Floats,
    lens: Floats,
    marker: Floats,
    cube: Floats,
    poses: Floats,
    kinds: Ints,
    sizes: Floats,
    work: Floats,
) -> int:
    """n looks at one view."""
    total = 0
    for _ in range(n):
        total += see(camera, lens, marker, cube, poses, kinds, sizes, work)
    return total


def kernel_us(eye: GeometricEye, view: View) -> float:
    """Least time of a look, us, of five series."""
    arrays = (
        view.camera,
        eye._lens,
        view.marker,
        eye._cube,
        view.occluders,
        eye._kinds,
        eye._sizes,
        eye._tags,
        eye._work,
    )
    again(1, *arrays)
    return 1e6 / REPEATS * min(seconds(lambda: again(REPEATS, *arrays)) for _ in range(5))


def seconds(work: Callable[[], object]) -> float:
    start = perf_counter()
    work()
    return perf_counter() - start


def towards_hand(vantages: Vantages, arm: Floats) -> Floats:
    """The head posture of the grid that looks nearest to the hand."""
    ray = vantages.body.view(arm, vantages.heads[0]).marker[:3] - vantages.cameras[:, :3]
    along = -(vantages.cameras[:, 5::3] * ray).sum(axis=1) / np.linalg.norm(ray, axis=1)
    return vantages.heads[along.argmax()]


def case(eye: GeometricEye, bare: GeometricEye, view: View) -> str:
    if eye.find(view) is not None:
        return "in view"
    empty = View(view.camera, view.marker, np.empty((0, 12)))
    return "not in view" if bare.find(empty) is None else "occluded"


def draw_and_search(body: MujocoBody, eye: FiducialEye, arm: Floats, head: Floats, part: Part | None) -> list[float]:
    """Processor time of this thread to draw a picture, or a part of it, and to search it, us."""
    body.place(arm, head)
    marks = [thread_time()]
    image = body.picture(part=part)
    marks.append(thread_time())
    eye.detect(image, part)
    marks.append(thread_time())
    return [1e6 * (end - start) for start, end in pairwise(marks)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--postures", type=int, default=600)
    count = parser.parse_args().postures
    body, rng = MujocoBody("nao", "kinematic"), np.random.default_rng(0)
    eye = GeometricEye(body.camera, body.marker, body.occluders)
    bare = GeometricEye(body.camera, body.marker, Shapes(np.empty(0, np.int64), np.empty((0, 4))))
    arms = rng.uniform(body.arm.lower, body.arm.upper, (count, len(body.arm)))
    vantages = Vantages.of(body)
    heads = np.array([towards_hand(vantages, arm) for arm in arms])
    views = [body.view(arm, head) for arm, head in zip(arms, heads, strict=True)]
    times = defaultdict(list)
    for view in views:
        times[case(eye, bare, view)].append(kernel_us(eye, view))
    for name, cost in sorted(times.items()):
        print(f"look, {name:12} {np.median(cost):9.2f} us   ({len(cost)} views)")
    sizes = optics(body.camera, body.marker)
    may_be_seen(views[0].camera, views[0].marker, *sizes)
    for name, hit in (("hit", True), ("miss", False)):
        kind = [view for view in views if (eye.find(view) is not None) == hit]
        cost = min(seconds(lambda kind=kind: [eye.find(view) for view in kind]) for _ in range(5))  # type: ignore[misc]
        print(f"find, from Python, {name:4} {1e6 / len(kind) * cost:9.2f} us")
    told = seconds(lambda: [may_be_seen(view.camera, view.marker, *sizes) for view in views])
    print(f"may_be_seen        {1e6 / count * told:9.2f} us")
    reachable(vantages, arms[:2])
    print(f"ceiling            {1e6 / count * seconds(lambda: reachable(vantages, arms)):9.2f} us a posture")
    print(f"all head postures  {1e6 / 100 * seconds(lambda: [vantages.seeing(arm) for arm in arms[:100]]):9.2f} us")
    rendered, spent = FiducialEye(body.camera, body.marker), []
    for view, arm, head in zip(views, arms, heads, strict=True):
        part = part_with_tags(view.camera, view.marker, *sizes)
        if part[2]:
            spent.append(
                [*draw_and_search(body, rendered, arm, head, None), *draw_and_search(body, rendered, arm, head, part)]
            )
    for name, (draw, search) in zip(
        ("whole picture", "part of it"), np.median(spent, axis=0).reshape(2, 2), strict=True
    ):
        print(f"{name:13} draw {draw:8.0f} us, search {search:5.0f} us   (of {len(spent)} that may show a tag)")
    body.close()


if __name__ == "__main__":
    main()
