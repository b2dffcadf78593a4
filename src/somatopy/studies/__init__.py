"""Studies: many runs, planned, run in many processes, and gathered in one table."""

from somatopy.studies.api import study
from somatopy.studies.plan import Condition, Study
from somatopy.studies.reading import load_plan, planned

__all__ = ["Condition", "Study", "load_plan", "planned", "study"]
