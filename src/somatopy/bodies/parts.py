"""Cuts a model into parts that do not influence each other, so that each can be stepped by itself.

A tree is a moving body on a base that stands still, with all bodies that hang on it. A NAO on fixed legs has three: its
head and its arms. Trees that cannot touch, hold or drive each other move independently. In one model they still share
rounding errors: the root's centre of mass is the origin of their spatial quantities, and the solver stops when all are
solved. In a part of its own, the arm moves the same to the last bit, whatever the head does. A part has no shapes that
are only drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

__all__ = ["cut", "name_all", "trees_of"]

_GEOMS = mujoco.mjtInertiaFromGeom
_BY_JOINT = (int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT))
Trees = frozenset[int]


def name_all(spec: mujoco.MjSpec) -> None:
    """Name all bodies, joints, geoms and servos that have no name, so that they can be found in each part."""
    for kind, things in (
        ("body", spec.bodies),
        ("joint", spec.joints),
        ("geom", spec.geoms),
        ("actuator", spec.actuators),
    ):
        for k, thing in enumerate(things):
            thing.name = thing.name or f"somatopy_{kind}_{k}"


def trees_of(model: mujoco.MjModel, arm: Sequence[str], head: Sequence[str]) -> tuple[Trees, Trees] | None:
    """The trees that are stepped with the arm, and those with the head. None if arm and head depend on each other.

    Args:
        model: the whole model.
        arm: names of the arm's joints.
        head: names of the head's joints.
    """
    if not _stands_alone(model):
        return None
    touching, tree, groups = _touching(model), model.body_treeid[model.geom_bodyid], np.arange(model.ntree)
    for first, second in np.unique(tree[np.argwhere(touching)], axis=0):
        if min(first, second) >= 0:
            groups[groups == groups[second]] = groups[first]
    of_arm, of_head = (
        {int(groups[model.dof_treeid[model.joint(name).dofadr[0]]]) for name in names} for names in (arm, head)
    )
    if of_arm & of_head:
        return None
    with_head = np.isin(groups, list(of_head))
    return frozenset(np.flatnonzero(~with_head).tolist()), frozenset(np.flatnonzero(with_head).tolist())


def _stands_alone(model: mujoco.MjModel) -> bool:
    """Whether nothing but touching couples trees: no equality, tendon, flexible body, plugin, or motor between them."""
    couplings = model.neq, model.ntendon, model.nflex, model.nplugin, model.nmocap
    return not any(couplings) and bool(np.isin(model.actuator_trntype, _BY_JOINT).all())


def _touching(model: mujoco.MjModel) -> NDArray[np.bool_]:
    """Which geoms can push each other, shape (ngeom, ngeom); arm and head, which only notice each other, cannot."""
    one_way = (model.geom_contype[:, None] & model.geom_conaffinity) != 0
    touching = one_way | one_way.T
    for signature in model.exclude_signature:
        first, second = (model.geom_bodyid == body for body in divmod(int(signature), 1 << 16))
        touching[np.ix_(first, second)] = touching[np.ix_(second, first)] = False
    for first, second, margin in zip(model.pair_geom1, model.pair_geom2, model.pair_margin, strict=True):
        touching[first, second] = touching[second, first] = margin > -1.0
    return np.asarray(touching)


def cut(spec: mujoco.MjSpec, model: mujoco.MjModel, trees: Trees) -> mujoco.MjModel:
    """The model of some trees alone, with those bodies that stand still and can be touched by them.

    Args:
        spec: the spec of the whole model. Its bodies, joints, geoms and actuators must have names.
        model: the whole model.
        trees: indices of the trees. Nothing may couple them to other trees.
    """
    part = spec.copy()
    for things in (part.keys, part.cameras, part.lights, part.sensors, part.skins, part.tuples):
        for thing in list(things):
            part.delete(thing)
    _keep_inertias(part, model)
    for tree in set(range(model.ntree)) - trees:
        part.delete(part.body(model.body(model.tree_bodyadr[tree]).name))
    _leave_out_untouchable(part, model, trees)
    _leave_out_empty(part, part.worldbody.bodies)
    return part.compile()


def _keep_inertias(part: mujoco.MjSpec, model: mujoco.MjModel) -> None:
    """Bodies keep the mass of the shapes that are cut away."""
    by_shape = part.compiler.inertiafromgeom == _GEOMS.mjINERTIAFROMGEOM_TRUE
    for body in part.bodies[1:]:
        if by_shape or not body.explicitinertial:
            whole = model.body(body.name)
            body.mass, body.ipos, body.iquat, body.inertia = whole.mass[0], whole.ipos, whole.iquat, whole.inertia
            body.fullinertia, body.ialt.type = np.full(6, np.nan), mujoco.mjtOrientation.mjORIENTATION_QUAT
            body.explicitinertial = bool(body.mass > 0)
    part.compiler.inertiafromgeom = _GEOMS.mjINERTIAFROMGEOM_FALSE


def _leave_out_untouchable(part: mujoco.MjSpec, model: mujoco.MjModel, trees: Trees) -> None:
    touching, tree = _touching(model), model.body_treeid[model.geom_bodyid]
    moving, there = np.isin(tree, list(trees)), np.isin(tree, [-1, *trees])
    touched = (moving & touching[:, there].any(axis=1)) | (there & touching[:, moving].any(axis=1))
    touched |= moving & (model.geom_fluid[:, 0] > 0)  # air and water push those with fluidshape="ellipsoid"
    gone = [geom for geom in part.geoms if not touched[model.geom(geom.name).id]]
    names = {geom.name for geom in gone}
    for thing in [pair for pair in part.pairs if {pair.geomname1, pair.geomname2} & names] + gone:
        part.delete(thing)


def _leave_out_empty(part: mujoco.MjSpec, bodies: Any) -> None:
    """Leave out bodies that stand still and carry nothing."""
    for body in list(bodies):
        _leave_out_empty(part, body.bodies)
        if not (body.joints or body.geoms or body.bodies):
            part.delete(body)
