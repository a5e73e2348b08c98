"""Why a target was lost: a diagnosis from a run's own numbers, by the declared roles of what it reports."""

from pftrack.diagnosis.course import COLUMNS, Course, course_of
from pftrack.diagnosis.diagnosis import Diagnosis, Evidence, course_of_run, diagnose, diagnose_course, picture_size
from pftrack.diagnosis.rules import RULES
from pftrack.diagnosis.sign import Rule, Sign

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
