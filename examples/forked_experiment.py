"""Which parts must go on learning after a damage: the maps, the links, both, or neither?

One run trains the paper's learner. Four continuations of it then meet the damage, each with other parts that learn.

usage: python forked_experiment.py [MINUTES of training and of each continuation, 10 by default]
"""

import sys
from pathlib import Path

from somatopy import fork, paper, run
from somatopy.experiment import frames_of

frames = frames_of(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
trained, damaged = (phase.replaced(frames=frames, trend_breaks=()) for phase in paper().phases)
base = paper().replaced(name="forked", eye={"kind": "geometric"}, body={"motion": "kinematic"}, phases=(trained,))

first = run(base, progress=False)
print(f"{'before damage':<22}{first.summary['phases'][0]['rate']:.1%}")
maps = ("arm_map", "head_map")
for name, plastic in {"both": (*maps, "links"), "links": ("links",), "maps": maps, "nothing": ()}.items():
    after = base.replaced(phases=(trained, damaged.replaced(plastic=plastic)))
    second = fork(first.path, after, out=Path(f"{first.path}_{name}"), progress=False)
    print(f"{name + ' learn':<22}{second.summary['phases'][1]['rate']:.1%}")
