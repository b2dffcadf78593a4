"""Run the paper's experiment, shortened: 20 minutes intact, then 10 minutes with a damage to the arm's sense."""

from somatopy import paper, run

intact, damaged = paper().phases
short = paper().replaced(phases=(intact.replaced(frames=20 * 900), damaged.replaced(frames=10 * 900)))
result = run(short)
for phase in result.summary["phases"]:
    print(f"{phase['damage']:>7}: hand seen in {phase['rate']:.1%} of {phase['frames']} frames")
print(result.path)
