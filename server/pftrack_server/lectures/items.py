"""What is known of a lecture's items on this server: title, page, minutes, and why one cannot be shown here."""

import json
from base64 import urlsafe_b64encode
from collections.abc import Sequence
from typing import Final

from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments import find as find_experiment
from pftrack.teaching.lessons.lesson import Lesson
from pftrack_server.core.bodies import printable
from pftrack_server.core.errors import NotFoundError
from pftrack_server.lessons.service import Lessons
from pftrack_server.schemas.lectures import Kind, LectureAsks, LectureItem, LectureItemPublic, LectureRun
from pftrack_server.work.failures import failure_named
from pftrack_server.work.sources import ComparedRun

USUAL_MINUTES: Final[dict[Kind, float]] = {
    "lesson": 8,
    "failure": 5,
    "session": 5,
    "comparison": 5,
    "question": 2,
    "poll": 2,
}
"""Of a lesson the lesson itself says how long it takes, where it is here."""


def check_names(items: Sequence[LectureItem], lines: Sequence[int]) -> None:
    """Refuse items with a run that names a tracker or a parameter that its experiment, if that is here, does not have.

    Raises:
        RefusedError: One does; the sentence names its line.
    """
    for item, line in zip(items, lines, strict=True):
        runs = [item.session] if item.session else item.comparison.runs if item.comparison else []
        for recipe in (run.recipe for run in runs if run.recipe is not None):
            if recipe.experiment in EXPERIMENTS:
                try:
                    EXPERIMENTS[recipe.experiment].check_names(recipe)
                except ParameterError as error:
                    raise RefusedError(f"Line {line}: {error}.", field=error.field) from None


class ItemViews:
    """Views of items.

    Args:
        lessons: Those of the server.
    """

    def __init__(self, lessons: Lessons) -> None:
        self._lessons = lessons

    async def of(self, items: Sequence[LectureItem], lines: Sequence[int], lecture: str) -> list[LectureItemPublic]:
        """Return what is known of items.

        Args:
            items: Of the lecture.
            lines: In which each stands in the file.
            lecture: Name of the lecture.
        """
        return [await self._view(item, line, lecture) for item, line in zip(items, lines, strict=True)]

    async def _view(self, item: LectureItem, line: int, lecture: str) -> LectureItemPublic:
        title, page, minutes, problem = _named(item), None, USUAL_MINUTES[item.kind], None
        asks = None
        try:
            match item:
                case LectureItem(lesson=str() as name):
                    lesson = await self._lesson(name)
                    title, page, minutes = lesson.title, f"learn/{lesson.id}", lesson.minutes
                case LectureItem(failure=str() as name):
                    failure = failure_named(name).failure
                    title, page = failure.title, f"failures/{failure.id}"
                case LectureItem(session=LectureRun() as run):
                    title, page = _title_of([run]), _session_page(run)
                case LectureItem(comparison=compared) if compared is not None:
                    title = _title_of(compared.runs)
                    page = _page("compare", compared.model_dump(mode="json", exclude_defaults=True))
                case LectureItem(question=str() as name):
                    lesson = await self._lesson(name)
                    title = f"Question: {lesson.title}"
                    asks = LectureAsks(lesson=lesson.id, lecture=lecture)
                case LectureItem(poll=str() as question):
                    title = printable(question)
                    asks = LectureAsks(question=question, answers=item.answers, lecture=lecture)
        except (NotFoundError, RefusedError) as error:
            problem = f"Line {line}: {error}"
        return LectureItemPublic(
            item=item.model_dump(mode="json", exclude_defaults=True),
            kind=item.kind,
            title=item.title or title,
            minutes=item.minutes or minutes,
            page=page,
            asks=asks,
            problem=problem,
        )

    async def _lesson(self, name: str) -> Lesson:
        """Return a lesson.

        Raises:
            NotFoundError: There is none; the many that there are stand beside the order.
        """
        try:
            return await self._lessons.get(name)
        except NotFoundError:
            raise NotFoundError(f"There is no lesson {name!r} here; it may be another lecturer's.") from None


def _named(item: LectureItem) -> str:
    """Return what an item is called of which nothing is known."""
    name = item.lesson or item.failure or item.question
    return f"{item.kind.capitalize()} {name}" if name else item.kind.capitalize()


def _title_of(runs: Sequence[ComparedRun]) -> str:
    """Return what runs are called: by their experiments.

    Raises:
        RefusedError: One is not here.
        ParameterError: One names a tracker or a parameter that its experiment does not have.
    """
    titles = []
    for recipe in (run.recipe for run in runs if run.recipe is not None):
        experiment = find_experiment(recipe.experiment)
        experiment.check_names(recipe)
        titles.append(experiment.title)
    each = " and ".join(dict.fromkeys(titles)) or "Run of this server"
    return each if len(runs) == 1 else f"{each}, {len(runs)} runs compared"


def _session_page(run: LectureRun) -> str:
    """Return the address of a new session.

    Raises:
        RefusedError: It is that of a run by its name, as in a file that somebody wrote.
    """
    if run.recipe is None:
        raise RefusedError("A session is named by its recipe in a file; add the run on the page of the lecture.")
    told = run.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    return _page("session/new", told)


def _page(path: str, told: object) -> str:
    """Return the address of a page with what it is to show in its fragment, as `shared/share_link.js` reads it."""
    text = json.dumps(told, separators=(",", ":"))
    return f"{path}#{urlsafe_b64encode(text.encode()).decode().rstrip('=')}"
