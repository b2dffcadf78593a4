"""The damages that `--damages all` stands for, by name: one of each kind, some in several strengths."""

from __future__ import annotations

from types import MappingProxyType
from typing import Any

__all__ = ["JOINTS", "SUITE"]

#: How many joints an arm must have for a damage, by its name; one where nothing is said.
JOINTS: MappingProxyType[str, int] = MappingProxyType(
    {"swapped": 2, "permuted": 2, "dead-joint-1": 2, "dead-joint-2": 3}
)
#: Settings of each damage by its name, as tables. Those that name a joint mean, on a NAO, its shoulder's roll and its
#: elbow's yaw.
SUITE: MappingProxyType[str, dict[str, Any]] = MappingProxyType(
    {
        "offset-0.3": {"kind": "random-offset", "norm": 0.3},
        "offset-0.8": {"kind": "random-offset", "norm": 0.8},
        "offset-1.7": {"kind": "random-offset", "norm": 1.7},
        "gain": {"kind": "gain", "gain": 0.7},
        "swapped": {"kind": "swapped"},
        "permuted": {"kind": "permuted"},
        "dead-joint-1": {"kind": "dead-joint", "joint": 1},
        "dead-joint-2": {"kind": "dead-joint", "joint": 2},
        "noise": {"kind": "noise", "deviation": 0.05},
        "drift": {"kind": "drift", "norm": 1.0, "minutes": 15.0},
        "head-offset": {"kind": "head-offset", "offset": 0.2},
        "mirrored": {"kind": "mirrored"},
        "camera-tilt": {"kind": "camera", "tilt": 10.0, "roll": 0.0},
        "camera-roll": {"kind": "camera", "tilt": 0.0, "roll": 10.0},
        "marker-5cm": {"kind": "marker", "by": 0.05},
        "marker-15cm": {"kind": "marker", "by": 0.15},
        "longer-arm": {"kind": "longer-arm", "factor": 1.2},
        "arm-speed": {"kind": "arm-speed", "factor": 0.5},
        "babbling-range": {"kind": "babbling-range", "range": 0.5},
    }
)
