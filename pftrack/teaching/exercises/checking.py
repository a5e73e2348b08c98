"""Checking: all that an exercise demands, of one file."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from pftrack.experiments.own import FilterFileError, name_of, trust
from pftrack.teaching.exercises.exercise import Check, Exercise
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Submission
from pftrack.teaching.exercises.verdict import Verdict

__all__ = ["Finding", "Report", "check", "check_text", "findings_of"]


@dataclass(frozen=True)
class Finding:
    """What came of one check.

    Attributes:
        check: Which.
        verdict: Whether the property holds, and how that was seen.
    """

    check: Check
    verdict: Verdict

    @property
    def title(self) -> str:
        """What should hold."""
        return PROPERTIES[self.check.property].title

    @property
    def points(self) -> float:
        """What was reached."""
        return self.check.points if self.verdict.holds else 0.0


@dataclass(frozen=True)
class Report:
    """What came of a file.

    Attributes:
        exercise: Which it answers.
        file: Its name.
        findings: In the order of the exercise's checks.
        seconds: How long it took.
    """

    exercise: Exercise
    file: str
    findings: tuple[Finding, ...]
    seconds: float

    @property
    def points(self) -> float:
        """What was reached of `exercise.points`."""
        return sum(each.points for each in self.findings)

    @property
    def passed(self) -> bool:
        """Whether all properties hold."""
        return all(each.verdict.holds for each in self.findings)


def check(exercise: Exercise, file: Path, *, seed: int = 0, told: Callable[[int, int], object] | None = None) -> Report:
    """Check a file, which is executed: whoever names it trusts it.

    Args:
        exercise: That it answers.
        file: Its path.
        seed: The first that draws and scenes are made of; another shows whether a solution hangs on it.
        told: Called with the checks that are done, and with all that there are.
    """
    text = file.read_text(encoding="utf-8")
    return check_text(exercise, name_of(file), text, seed=seed, told=told)


def check_text(
    exercise: Exercise,
    name: str,
    text: str,
    *,
    seed: int = 0,
    told: Callable[[int, int], object] | None = None,
) -> Report:
    """Check the text of a file, which is executed; see `check`."""
    begun = monotonic()
    findings: list[Finding] = []
    for each in findings_of(exercise, name, text, seed):
        findings.append(each)
        if told is not None:
            told(len(findings), len(exercise.checks))
    return Report(exercise, f"{name}.py", tuple(findings), monotonic() - begun)


def findings_of(exercise: Exercise, name: str, text: str, seed: int) -> Iterator[Finding]:
    """Yield what comes of each check as it comes; the text is trusted, and executed."""
    trust(text)
    submission = Submission(exercise, name, text)
    for each in exercise.checks:
        yield Finding(each, _look(submission, each, seed))


def _look(submission: Submission, asked: Check, seed: int) -> Verdict:
    """Return whether a property holds; a file that breaks does not have it."""
    known = PROPERTIES[asked.property]
    try:
        missing = [name for name in submission.exercise.functions if name not in submission.code.functions]
        if missing:
            return Verdict(False, f"{submission.code.file} does not define {', '.join(missing)}.", {}, None)
        return known.look(submission, {**known.options, **asked.options}, seed)
    except FilterFileError as error:
        return Verdict(False, f"{error}.", {}, seed)
