"""A body, an eye, a babbler, a learner and an intervention that do not come from somatopy."""
