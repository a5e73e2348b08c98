"""Grading: a folder of submissions, each checked in a confined process of its own, and told as it comes.

A submission is a program of somebody else. Its process has limits on time, memory and files, and no network where the
system allows that. It is still the same user, and is asked about by code that runs beside it: these limits are for
programs that run wild, not for a person who wants to cheat.
"""

from collections.abc import Generator, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from pftrack.exercises.checking import check_text
from pftrack.exercises.exercise import Exercise
from pftrack.exercises.library import exercise_named_in
from pftrack.exercises.reports import results
from pftrack.filter_files import FilterFileError, name_of
from pftrack.process import MEBIBYTE, Budget, Ending, Fault, ForkServer, Outcome, Refusal, Reply, run_task_blocking

__all__ = ["BUDGET", "grade", "submissions_in"]

PRELOAD: Final = "pftrack.exercises.preload"
BUDGET: Final = Budget(
    memory_bytes=1024 * MEBIBYTE,
    cpu_seconds=120.0,
    silence_s=90.0,
    file_bytes=16 * MEBIBYTE,
    answer_bytes=4 * MEBIBYTE,
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
    budget: Budget = BUDGET,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield each submission's name and results, as `reports.results` has them, as they come.

    Args:
        files: By who handed them in.
        exercises: All that may be answered.
        exercise: The one that all answer; what each says of itself if not given.
        seed: As of `checking.check`.
        budget: What each may take.
    """
    fork_server = ForkServer(PRELOAD)
    try:
        for name, path in files.items():
            yield name, _grade(fork_server, path, exercises, exercise, seed, budget)
    finally:
        fork_server.close()


def _grade(
    fork_server: ForkServer,
    path: Path,
    exercises: Mapping[str, Exercise],
    exercise: str | None,
    seed: int,
    budget: Budget,
) -> dict[str, Any]:
    try:
        text, tracker = path.read_text(encoding="utf-8"), name_of(path)
    except (OSError, ValueError) as error:
        return _nothing(str(error), None)
    named = exercise or exercise_named_in(text)
    if named not in exercises:
        said = f"it names the exercise {named}, which there is not" if named else "it has no line EXERCISE = ..."
        return _nothing(f"Which exercise it answers is not known: {said}.", None)
    wanted = exercises[named]
    outcome = run_task_blocking(
        fork_server,
        check_confined,
        wanted,
        tracker,
        text,
        seed,
        budget=budget,
        refusals=(FilterFileError,),
    )
    return outcome.value if isinstance(outcome, Reply) else _nothing(_problem(outcome, budget), wanted)


def check_confined(exercise: Exercise, name: str, text: str, seed: int) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Return the results of a submission; for a confined process, which tells after each check how far it is."""
    findings: list[Any] = []
    seconds = 0.0
    report = None
    for number, each in enumerate(exercise.checks, 1):
        report = check_text(replace(exercise, checks=(each,)), name, text, seed=seed)
        findings += report.findings
        seconds += report.seconds
        yield number, len(exercise.checks)
    whole = replace(report, exercise=exercise, findings=tuple(findings), seconds=seconds) if report else None
    found = results(whole) if whole else {}
    found["extra_data"] |= {"network": has_network()}
    return found


def has_network() -> bool:
    """Return whether this process sees a network beside its own machine; where that cannot be told, it is assumed."""
    try:
        lines = Path("/proc/self/net/dev").read_text(encoding="ascii").splitlines()[2:]
    except OSError:
        return True
    return any(line.partition(":")[0].strip() != "lo" for line in lines)


def _nothing(problem: str, exercise: Exercise | None) -> dict[str, Any]:
    extra = {"exercise": exercise.id} if exercise else {}
    most = exercise.points if exercise else 0.0
    return {"score": 0.0, "max_score": most, "output": problem, "extra_data": extra, "tests": []}


def _problem(outcome: Outcome, budget: Budget) -> str:
    match outcome:
        case Refusal(message=message):
            return message
        case Fault(name=name):
            return f"It could not be checked: {name}"
        case Ending.OUT_OF_TIME:
            return f"It said nothing for {budget.silence_s:g} s and was stopped."
        case Ending.OUT_OF_CPU_TIME:
            return f"It took more than the {budget.cpu_seconds:g} s of processor time that it may use."
        case _:
            return "Its process was ended or has ended itself; perhaps it took more memory than it may."
