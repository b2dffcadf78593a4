# %% [markdown]
# # Your own learner
#
# A learner is one class. It is told what is felt and seen, fifteen times a second, and says where to look. This one
# remembers every arm posture at which it saw the hand, together with its head posture. It looks where it looked at
# the most similar posture.

# %%
import numpy as np

from somatopy import check_learner, paper, run
from somatopy.experiment import frames_of
from somatopy.learners import Plastic, Scale


class Remembers(Plastic):
    """Looks where it last saw the hand with the arm nearest to where it is now; it searches where that fails."""

    parts = frozenset({"memory"})  # what can learn, and can be frozen

    def __init__(self, robot, rng, size: int = 500):
        self.arm, self.head, self.rng = Scale(robot.arm.limits), Scale(robot.head.limits), rng
        self.arms, self.heads = np.full((size, len(robot.arm)), np.inf), np.full((size, len(robot.head)), 0.5)
        self.count = 0

    def observe(self, percept):
        """Learn from what was felt and seen."""
        if percept.sighting is not None and "memory" in self.plastic:
            place = self.count % len(self.arms)  # the oldest is forgotten
            self.arms[place], self.heads[place] = self.arm.to_unit(percept.arm), self.head.to_unit(percept.head)
            self.count += 1

    def predict(self, arm):
        """Where to look with the arm at a posture; asking changes nothing."""
        distances = ((self.arms - self.arm.to_unit(arm)) ** 2).sum(axis=1)
        return self.head.to_angle(self.heads[np.argmin(distances)])

    def gaze(self, percept):
        """Where to look now."""
        spread = 0.02 if percept.sighting else 0.15
        units = self.head.to_unit(self.predict(percept.arm)) + self.rng.normal(0, spread, len(self.head.low))
        return self.head.to_angle(np.clip(units, 0, 1))

    def state(self):
        """All that learning has changed, as plain data."""
        drawn = self.rng.bit_generator.state
        return {"arms": self.arms.copy(), "heads": self.heads.copy(), "count": self.count, "rng": drawn}

    def restore(self, state):
        """Go back to it."""
        self.arms, self.heads, self.count = np.array(state["arms"]), np.array(state["heads"]), state["count"]
        self.rng.bit_generator.state = state["rng"]


# %% [markdown]
# ## Does it keep the contract?
#
# The check tries every law that learners promise to keep. It is silent, or it says which law is broken, what was
# seen, and how to mend it. Here is one mistake: a `state` that gives away the learner's own array, so that what was
# kept changes later.

# %%
check_learner(Remembers)
print("Remembers keeps the contract.")


class GivesItselfAway(Remembers):
    def state(self):
        return {**super().state(), "heads": self.heads}


try:
    check_learner(GivesItselfAway)
except Exception as error:
    print(type(error).__name__, "-", error)

# %% [markdown]
# ## Does it see the hand?
#
# The same seed means the same movement of the arm, so that learners can be compared.

# %%
described = paper().replaced(seed=1, eye={"kind": "geometric"}, body={"motion": "kinematic"})
phase = described.phases[0].replaced(frames=frames_of(10), trend_breaks=())
described = described.replaced(phases=[phase])
for name, learner in {"the paper's": None, "Remembers": Remembers}.items():
    summary = run(described, name, learner=learner, progress=False).summary
    print(f"{name:>12}: hand seen in {summary['phases'][0]['rate']:.1%} of 10 minutes")

# %% [markdown]
# These are not the numbers of the README. Here joints obey at once, and the head moves at its limit, since `replaced`
# replaces a part as a whole, and the preset's `head_speed` goes with it. One seed says little: compare under many.
#
# In a file of its own, `my_file.py`, the learner also runs from the command line, and meets every damage. The second
# command makes 120 runs; with `--dry-run` it only says how long they take.
#
# ```sh
# somatopy run paper --learner my_file:Remembers --minutes 30 --eye geometric
# somatopy compare --learners hebbian,my_file:Remembers --damages none,all --seeds 3 --minutes 30 --damage-minutes 15
# ```
#
# Next: [settings, and all the other parts that can be yours](../../CONTRIBUTING.md#add-yours).
