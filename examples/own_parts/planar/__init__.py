"""A robot, an eye, a babbler, a learner and an intervention that somatopy knows nothing of."""
