"""Why a target was lost: a diagnosis from a run's own numbers, by the declared roles of what it reports."""

from pftrack.analysis.diagnosis.course import COLUMNS, Course, course_of
from pftrack.analysis.diagnosis.diagnosis import (
    Diagnosis,
    Evidence,
    course_of_run,
    diagnose,
    diagnose_course,
    picture_size,
)
from pftrack.analysis.diagnosis.rules import RULES
from pftrack.analysis.diagnosis.sign import Rule, Sign

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
