"""Why a target was lost: a diagnosis from a run's own numbers, by the declared roles of what it reports.

- `course`: what a run's rows say over time, and the moment in question; `diagnosis`: the rules together;
- `rules`: a function for each cause; what they say in words stands in signs.yaml.
"""

from pftrack.analysis.diagnosis.course import COLUMNS, Course, Rule, Sign, course_of
from pftrack.analysis.diagnosis.diagnosis import (
    Diagnosis,
    Evidence,
    course_of_run,
    diagnose,
    diagnose_course,
    picture_size,
)
from pftrack.analysis.diagnosis.rules import RULES

__all__ = [
    "COLUMNS",
    "RULES",
    "Course",
    "Diagnosis",
    "Evidence",
    "Rule",
    "Sign",
    "course_of",
    "course_of_run",
    "diagnose",
    "diagnose_course",
    "picture_size",
]
