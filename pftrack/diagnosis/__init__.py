"""Why a target was lost: a diagnosis from a run's own numbers, by the declared roles of what it reports."""

from pftrack.diagnosis.course import Course, course_of
from pftrack.diagnosis.diagnosis import Diagnosis, Evidence, diagnose, diagnose_course
from pftrack.diagnosis.rules import RULES, Rule, Sign

__all__ = ["RULES", "Course", "Diagnosis", "Evidence", "Rule", "Sign", "course_of", "diagnose", "diagnose_course"]
