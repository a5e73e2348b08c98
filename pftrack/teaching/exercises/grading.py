"""Grading: submissions, each checked in its own confined process, and reported to graders.

A submission is another person's program. Its process has limits on time, memory and files, and no network where the
system allows that. It is still the same user, and code in the same process queries it: these limits stop runaway
programs, not a person who wants to cheat.
"""

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import asdict, dataclass
from itertools import islice
from pathlib import Path
from time import monotonic
from typing import Any, Final

from pftrack import process
from pftrack.core.files import read_source
from pftrack.experiments.own.code import FilterFileError, trust
from pftrack.experiments.own.extension import name_of
from pftrack.teaching.exercises.library import exercise_named_in
from pftrack.teaching.exercises.properties import PROPERTIES
from pftrack.teaching.exercises.submission import Check, Exercise, SettledError, Submission, Verdict


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes:
        check: The check.
        verdict: Whether the property holds, and how that was seen.
    """

    check: Check
    verdict: Verdict

    @property
    def title(self) -> str:
        """The property."""
        return PROPERTIES[self.check.property].title

    @property
    def points(self) -> float:
        """The points."""
        return self.check.points if self.verdict.holds else 0.0


@dataclass(frozen=True)
class Report:
    """The result of a file.

    Attributes:
        exercise: Its exercise.
        file: Its name.
        findings: In the order of the exercise's checks.
        seconds: Its duration.
    """

    exercise: Exercise
    file: str
    findings: tuple[Finding, ...]
    seconds: float

    @property
    def points(self) -> float:
        """The points, at most `exercise.points`."""
        return sum(each.points for each in self.findings)

    @property
    def passed(self) -> bool:
        """Whether all properties hold."""
        return all(each.verdict.holds for each in self.findings)


def check(exercise: Exercise, file: Path, *, seed: int = 0, told: Callable[[int, int], object] | None = None) -> Report:
    """Check a file, which is executed: naming it means trusting it.

    Args:
        exercise: Its exercise.
        file: Its path.
        seed: The first that draws and scenes are made of; another shows whether a solution hangs on it.
        told: Called with the number of finished checks, and of all checks.
    """
    text = read_source(file)
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
    except SettledError as settled:
        return settled.verdict
    except FilterFileError as error:
        return Verdict(False, f"{error}.", {}, seed)


# Gradescope takes reports in the form `results.json`, which otter-grader writes as well.


def results(report: Report) -> dict[str, Any]:
    """Return a report as Gradescope's results: a score, and one test for each property."""
    tests = [
        {
            "number": str(number),
            "name": each.title,
            "score": each.points,
            "max_score": each.check.points,
            "status": "passed" if each.verdict.holds else "failed",
            "output": each.verdict.words,
            "visibility": "visible",
            "extra_data": {
                "property": each.check.property,
                "seed": each.verdict.seed,
                "numbers": dict(each.verdict.numbers),
            },
        }
        for number, each in enumerate(report.findings, 1)
    ]
    held = sum(each.verdict.holds for each in report.findings)
    return {
        "score": report.points,
        "max_score": report.exercise.points,
        "execution_time": round(report.seconds, 1),
        "output": f"{report.exercise.title}: {held} of {len(tests)} properties hold.",
        "visibility": "visible",
        "extra_data": {"exercise": report.exercise.id, "file": report.file},
        "tests": tests,
    }


def table_of(graded: Mapping[str, Mapping[str, Any]]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return a lecturer's table of many results: its columns, and a row for each submission.

    Args:
        graded: Results by submission.
    """
    properties: list[str] = []
    for each in graded.values():
        properties += [name for name in _by_property(each) if name not in properties]
    columns = ("name", "exercise", *properties, "score", "of", "problem")
    return columns, [_row(name, each, properties) for name, each in graded.items()]


def _by_property(found: Mapping[str, Any]) -> dict[str, str]:
    return {test["extra_data"]["property"]: f"{test['score']:g}" for test in found.get("tests", ())}


def _row(name: str, found: Mapping[str, Any], properties: Sequence[str]) -> tuple[str, ...]:
    points = _by_property(found)
    problem = "" if found.get("tests") else str(found.get("output", ""))
    shown = [points.get(each, "") for each in properties]
    exercise = str(found.get("extra_data", {}).get("exercise", ""))
    return name, exercise, *shown, f"{found['score']:g}", f"{found['max_score']:g}", problem


PRELOAD: Final = "pftrack.teaching.exercises.preload"
LONGEST_WORDS: Final = 2000
BUDGET: Final = process.Budget(
    memory_bytes=1024 * process.MEBIBYTE,
    cpu_seconds=120.0,
    silence_s=90.0,
    file_bytes=16 * process.MEBIBYTE,
    answer_bytes=4 * process.MEBIBYTE,
)
"""For one submission; a right one of those that are shipped takes some seconds."""


def submissions_in(folder: Path) -> dict[str, Path]:
    """Return the files in a folder by who handed them in: its own files, and the only one of each folder in it."""
    found = {path.stem: path for path in sorted(folder.glob("*.py"))}
    for inner in sorted(path for path in folder.iterdir() if path.is_dir()):
        files = sorted(inner.glob("*.py"))
        found |= {inner.name: files[0]} if len(files) == 1 else {f"{inner.name}/{path.stem}": path for path in files}
    return found


def grade(
    files: Mapping[str, Path],
    exercises: Mapping[str, Exercise],
    *,
    exercise: str | None = None,
    seed: int = 0,
    budget: process.Budget = BUDGET,
    jobs: int = 1,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each submission's name and results, as `results` has them, as they come.

    Args:
        files: By who handed them in.
        exercises: All that may be answered.
        exercise: The exercise of all; by default each file names its own.
        seed: As for `check`.
        budget: Limits of each.
        jobs: Number of simultaneous checks.
    """
    fork_server = process.ForkServer(PRELOAD)
    left, checked = iter(files.items()), dict[Future[dict[str, Any]], str]()
    try:
        with process.BackgroundLoop("grading") as loop:
            while True:
                for name, path in islice(left, jobs - len(checked)):
                    checked[loop.submit(_grade(fork_server, path, exercises, exercise, seed, budget))] = name
                if not checked:
                    return
                for each in wait(checked, return_when=FIRST_COMPLETED).done:
                    yield checked.pop(each), each.result()
    finally:
        fork_server.close()


async def _grade(
    fork_server: process.ForkServer,
    path: Path,
    exercises: Mapping[str, Exercise],
    exercise: str | None,
    seed: int,
    budget: process.Budget,
) -> dict[str, Any]:
    try:
        wanted, tracker, text = _read(path, exercises, exercise)
    except (OSError, ValueError) as error:
        return _nothing(str(error), None)
    outcome = await process.run_task(fork_server, check_confined, wanted, tracker, text, seed, budget=budget)
    if not isinstance(outcome, process.Reply):
        return _nothing(_problem(outcome, budget), wanted)
    try:
        report, network = _report_of(outcome.value, wanted, path.name)
    except (KeyError, TypeError, ValueError):
        return _nothing("Its process has answered something else than what came of the checks.", wanted)
    found = results(report)
    found["extra_data"]["network"] = network
    return found


def _read(path: Path, exercises: Mapping[str, Exercise], exercise: str | None) -> tuple[Exercise, str, str]:
    """Return which exercise a file answers, its name as a tracker, and its text.

    Raises:
        OSError: It cannot be read.
        ValueError: It is not a regular file or not text, has no such name, or which exercise it answers is not known.
    """
    if not path.is_file():  # a pipe would wait for a writer
        raise ValueError("It is not a regular file.")
    text, tracker = read_source(path), name_of(path)
    named = exercise or exercise_named_in(text)
    if named is None or named not in exercises:
        said = f"it names the exercise {named}, which there is not" if named else "it has no line EXERCISE = ..."
        raise ValueError(f"Its exercise is unknown: {said}.")
    return exercises[named], tracker, text


def check_confined(
    exercise: Exercise, name: str, text: str, seed: int
) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Return the results of all checks; for a confined process, which reports its progress after each."""
    begun = monotonic()
    told: list[dict[str, Any]] = []
    for each in findings_of(exercise, name, text, seed):
        told.append(asdict(each.verdict))
        yield len(told), len(exercise.checks)
    return {"verdicts": told, "seconds": monotonic() - begun, "network": has_network()}


def _report_of(answer: Any, exercise: Exercise, file: str) -> tuple[Report, bool]:  # noqa: ANN401 - of a process that may be anybody's
    """Return the report of a submission's process, trusted only on which properties hold."""
    verdicts = [
        Verdict(
            each["holds"] is True,
            str(each["words"])[:LONGEST_WORDS],
            {str(name): float(value) for name, value in each["numbers"].items()},
            None if each["seed"] is None else int(each["seed"]),
        )
        for each in answer["verdicts"]
    ]
    findings = tuple(Finding(check, verdict) for check, verdict in zip(exercise.checks, verdicts, strict=True))
    return Report(exercise, file, findings, float(answer["seconds"])), bool(answer["network"])


def has_network() -> bool:
    """Return whether this process sees a network beyond its own machine; if unknown, it is assumed."""
    try:
        lines = Path("/proc/self/net/dev").read_text(encoding="ascii").splitlines()[2:]
    except OSError:
        return True
    return any(line.partition(":")[0].strip() != "lo" for line in lines)


def _nothing(problem: str, exercise: Exercise | None) -> dict[str, Any]:
    extra = {"exercise": exercise.id} if exercise else {}
    most = exercise.points if exercise else 0.0
    return {"score": 0.0, "max_score": most, "output": problem, "extra_data": extra, "tests": []}


def _problem(outcome: process.Outcome, budget: process.Budget) -> str:
    match outcome:
        case process.Refusal(message=message):
            return message
        case process.Fault(name=name):
            return f"It could not be checked: {name}"
        case process.Ending.OUT_OF_TIME:
            return f"It said nothing for {budget.silence_s:g} s and was stopped."
        case process.Ending.OUT_OF_CPU_TIME:
            return f"It took more than the {budget.cpu_seconds:g} s of processor time that it may use."
        case _:
            return "Its process was ended or has ended itself; perhaps it took more memory than it may."
