"""One training, four continuations: which parts must go on learning after damage, maps, links, both or none?

usage: python forked_experiment.py [MINUTES of training and of each continuation, 10 by default]
"""

import sys
from pathlib import Path

from somatopy import paper, run
from somatopy.api import fork

minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 10.0
frames = round(900 * minutes)
trained, damaged = (phase.model_copy(update={"frames": frames, "trend_breaks": ()}) for phase in paper().phases)
base = paper().replaced(name="forked", eye={"kind": "geometric"}, body={"motion": "kinematic"}, phases=(trained,))

first = run(base)
print(f"{'before damage':<22}{first.summary['phases'][0]['rate']:.1%}")
maps = ("arm_map", "head_map")
for name, plastic in {"both": (*maps, "links"), "links": ("links",), "maps": maps, "nothing": ()}.items():
    after = damaged.model_copy(update={"plastic": plastic})
    second = fork(first.path, base.replaced(phases=(trained, after)), out=Path(f"{first.path}_{name}"))
    print(f"{name + ' learn':<22}{second.summary['phases'][1]['rate']:.1%}")
