"""The lectures of a server: stored as files, and read on request.

An item's view has its title, its page, its minutes, and the reason if it cannot be shown here. A file is not trusted,
like a lecturer's lesson, and is written so that a person can edit it.

---
title: From Bayes to particles
items:
- lesson: bayes
  minutes: 8
- poll: Will it survive the pillar?
  answers: [Yes, No]
---
Notes.
"""

import asyncio
import json
from base64 import urlsafe_b64encode
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple

import yaml

from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.experiments import EXPERIMENTS
from pftrack.experiments import find as find_experiment
from pftrack.teaching.lessons.document import EXPONENT, DocumentError, ask, decode, document_of
from pftrack.teaching.lessons.lesson import Lesson
from pftrack_server.core.bodies import fields_of, printable
from pftrack_server.core.errors import ApiError, gone, not_found
from pftrack_server.store.database import LectureRow
from pftrack_server.store.files import new_name, now
from pftrack_server.teaching import messages
from pftrack_server.teaching.lessons import Lessons
from pftrack_server.web.failures import failure_named
from pftrack_server.work.sources import ComparedRun, House, find_run

MOST = 200
"""Most stored lectures."""
USUAL_MINUTES: Final[dict[messages.Kind, float]] = {"lesson": 8, "question": 2, "poll": 2}
"""Default minutes of an item; an available lesson has minutes of its own."""
LARGEST_BYTES: Final = 128 * 1024
"""Largest file; items may hold whole recipes, while a lecture of lessons takes a hundredth of it."""
KEPT: Final = 64
"""Most parsed files in memory: a long file takes a second to read, and the list of lectures reads all."""
MOST_TOLD: Final = 5
FENCE: Final = "---"
WIDTH: Final = 100


class LectureText(NamedTuple):
    """The content of a lecture's file.

    Attributes:
        lecture: The lecture.
        lines: Line of each item, from 1.
    """

    lecture: messages.LectureUpdate
    lines: tuple[int, ...]


@lru_cache(KEPT)
def read_lecture(data: bytes) -> LectureText:
    """Parse a lecture's file.

    Raises:
        RefusedError: The file is too large, not text, or not a lecture; the message names the lines.
    """
    if len(data) > LARGEST_BYTES:
        raise RefusedError(f"The file is larger than {LARGEST_BYTES // 1024} KiB, the limit for lectures.")
    try:
        document = document_of(decode(data))
    except DocumentError as error:
        raise _refusal([error]) from None
    head = ask(document, messages.LectureUpdate, "a lecture", "docs/how-to/lectures.md")
    if isinstance(head, list):
        raise _refusal(head)
    lines = tuple(document.line(("items", place)) for place in range(len(head.items)))
    whole = {**dict(head), "notes": document.text or head.notes}
    if len(document.text) > messages.LONGEST_NOTES:
        message = f"the text has more than the {messages.LONGEST_NOTES:,} characters that notes may have"
        raise _refusal([DocumentError(document.text_line, message)])
    return LectureText(messages.LectureUpdate.model_construct(**whole), lines)


def write_lecture(lecture: messages.LectureUpdate) -> str:
    """Return the text of a lecture's file.

    Raises:
        RefusedError: The lecture is too large.
    """
    head = {
        "title": lecture.title,
        "items": [it.model_dump(mode="json", exclude_defaults=True) for it in lecture.items],
    }
    listed = yaml.dump(head, Dumper=_Writer, sort_keys=False, allow_unicode=True, width=WIDTH)
    text = f"{FENCE}\n{listed}{FENCE}\n" + (f"{lecture.notes.strip()}\n" if lecture.notes.strip() else "")
    if len(text.encode()) > LARGEST_BYTES:
        raise RefusedError(f"The lecture would have more than {LARGEST_BYTES // 1024} KiB; leave an item out.")
    return text


class _Writer(yaml.SafeDumper):  # type: ignore[misc]  # PyYAML has no types
    """Writes YAML that is read back as the same, even where text looks like a number with an exponent but no point."""

    def represent_str(self, data: str) -> yaml.ScalarNode:
        """Quote a text that would be read as a number."""
        style = "'" if EXPONENT.fullmatch(data) else None
        return self.represent_scalar("tag:yaml.org,2002:str", data, style)


_Writer.add_representer(str, _Writer.represent_str)


def _refusal(errors: list[DocumentError]) -> RefusedError:
    told = [f"line {error.line}: {error.message}" if error.line else error.message for error in errors[:MOST_TOLD]]
    more = f"; and {len(errors) - MOST_TOLD} more" if len(errors) > MOST_TOLD else ""
    sentence = "; ".join(told)
    return RefusedError(f"{sentence[:1].upper()}{sentence[1:]}{more}.", field="file")


class Lectures:
    """The lectures of a server.

    Args:
        house: Finds the runs that items may name.
        lessons: The lessons that items may name.
    """

    def __init__(self, house: House, lessons: Lessons) -> None:
        self._house = house
        self._store = house.store
        self._lessons = lessons

    async def all(self) -> Sequence[messages.LectureSummary]:
        """Return all lectures, newest first."""
        found = await asyncio.to_thread(lambda: [(row, _readable(row)) for row in self._store.all(LectureRow)])
        return [await self._public(row, text) for row, text in found if text is not None]

    async def get(self, name: str) -> messages.LecturePublic:
        """Return a lecture.

        Raises:
            ApiError: The stored file cannot be read (410), or the lecture does not exist (404).
        """
        row = await self._row(name)
        text = await asyncio.to_thread(_readable, row)
        if text is None:
            raise gone("The stored file of this lecture is damaged; it can only be deleted.")
        return await self._public(row, text)

    async def text(self, name: str) -> tuple[str, str]:
        """Return the title and the file's text of a lecture.

        Raises:
            ApiError: The lecture does not exist (404).
        """
        row = await self._row(name)
        return row.title, row.text

    async def add(self, lecture: messages.LectureUpdate) -> messages.LecturePublic:
        """Store a new lecture.

        Raises:
            ConflictError: The limit of lectures is reached.
            ApiError: A run that it names does not exist (404).
            RefusedError: The lecture is too large.
        """
        return await self._keep(await asyncio.to_thread(write_lecture, await self._self_contained(lecture)))

    async def bring_in(self, data: bytes) -> messages.LecturePublic:
        """Store the file of a lecture unchanged; problems of items that are missing here name their line.

        Raises:
            ConflictError: The limit of lectures is reached.
            RefusedError: The file is not a lecture.
        """
        await asyncio.to_thread(read_lecture, data)
        return await self._keep(data.decode("utf-8-sig"))

    async def change(self, name: str, lecture: messages.LectureUpdate) -> messages.LecturePublic:
        """Replace the content of a lecture.

        Raises:
            ApiError: The lecture, or a run that it names, does not exist (404).
            RefusedError: The lecture is too large.
        """
        row = await self._row(name)
        text = await asyncio.to_thread(write_lecture, await self._self_contained(lecture))
        return await self._save(LectureRow(id=name, title=lecture.title, text=text, created=row.created, updated=now()))

    # ------------------------------------------------------------ within

    async def _keep(self, text: str) -> messages.LecturePublic:
        if await asyncio.to_thread(self._store.count, LectureRow) >= MOST:
            raise ConflictError(f"The server keeps at most {MOST} lectures; delete one first.")
        lecture, _ = await asyncio.to_thread(read_lecture, text.encode())
        moment = now()
        return await self._save(
            LectureRow(id=new_name(), title=lecture.title, text=text, created=moment, updated=moment)
        )

    async def _save(self, row: LectureRow) -> messages.LecturePublic:
        text = await asyncio.to_thread(read_lecture, row.text.encode())
        _check_names(text)
        public = await self._public(row, text)
        await asyncio.to_thread(self._store.save, row)
        return public

    async def _row(self, name: str) -> LectureRow:
        return await asyncio.to_thread(self._store.find, LectureRow, name)

    async def _public(self, row: LectureRow, text: LectureText) -> messages.LecturePublic:
        lecture, lines = text
        items = [await self._view(item, line, row.id) for item, line in zip(lecture.items, lines, strict=True)]
        return messages.LecturePublic(
            **fields_of(messages.LecturePublic, row, lecture) | {"items": items},
            count=len(items),
            minutes=sum(item.minutes for item in items),
            page=f"lectures/{row.id}",
        )

    async def _view(self, item: messages.LectureItem, line: int, lecture: str) -> messages.LectureItemPublic:
        title, page, minutes, problem = _named(item), None, USUAL_MINUTES.get(item.kind, 5), None
        asks: messages.PollCreate | None = None
        try:
            match item:
                case messages.LectureItem(lesson=str() as name):
                    lesson = await self._lesson(name)
                    title, page, minutes = lesson.title, f"learn/{lesson.id}", lesson.minutes
                case messages.LectureItem(failure=str() as name):
                    failure = failure_named(name).failure
                    title, page = failure.title, f"failures/{failure.id}"
                case messages.LectureItem(session=messages.LectureRun() as run):
                    title, page = _title_of([run]), _session_page(run)
                case messages.LectureItem(comparison=compared) if compared is not None:
                    title = _title_of(compared.runs)
                    page = _page("compare", compared.model_dump(mode="json", exclude_defaults=True))
                case messages.LectureItem(question=str() as name):
                    lesson = await self._lesson(name)
                    title = f"Question: {lesson.title}"
                    asks = messages.PollCreate(lesson=lesson.id, lecture=lecture)
                case messages.LectureItem(poll=str() as question):
                    title = printable(question)
                    asks = messages.PollCreate(question=question, answers=item.answers, lecture=lecture)
        except RefusedError as error:
            problem = f"Line {line}: {error}"
        return messages.LectureItemPublic(
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
            ApiError: The lesson does not exist (404).
        """
        try:
            return await self._lessons.get(name)
        except ApiError:
            raise not_found(f"The lesson {name!r} does not exist here; it may be another lecturer's.") from None

    async def _self_contained(self, lecture: messages.LectureUpdate) -> messages.LectureUpdate:
        """Return a lecture with its runs as recipes, so that its file is complete on any server."""
        return lecture.model_copy(update={"items": [await self._with_recipes(item) for item in lecture.items]})

    async def _with_recipes(self, item: messages.LectureItem) -> messages.LectureItem:
        runs, titles = list(_runs_of(item)), []
        for place, run in enumerate(runs):
            if run.reference is not None:
                spec, title = await find_run(run, self._house)
                made: dict[str, object] = {"reference": None, "recipe": spec.recipe, "upload": spec.upload}
                if isinstance(run, messages.LectureRun):
                    made["position"] = (spec.run.position if run.position is None else run.position) or None
                runs[place] = run.model_copy(update=made)
                titles.append(title)
        update: dict[str, object] = {"session": runs[0]} if item.session else {}
        if item.comparison:
            update["comparison"] = item.comparison.model_copy(update={"runs": runs})
        if item.title is None and runs and len(titles) == len(runs) and all(titles):
            update["title"] = " · ".join(map(str, titles))[:200]
        return item.model_copy(update=update)


def _readable(row: LectureRow) -> LectureText | None:
    """Return the content of a stored file; None if it can no longer be read."""
    try:
        return read_lecture(row.text.encode())
    except RefusedError:
        return None


def _runs_of(item: messages.LectureItem) -> Sequence[ComparedRun]:
    return [item.session] if item.session else item.comparison.runs if item.comparison else []


def _check_names(text: LectureText) -> None:
    """Refuse items whose run names a tracker or parameter that its installed experiment does not have.

    Raises:
        RefusedError: An item does; the message names its line.
    """
    for item, line in zip(text.lecture.items, text.lines, strict=True):
        for recipe in (run.recipe for run in _runs_of(item) if run.recipe is not None):
            if recipe.experiment in EXPERIMENTS:
                try:
                    EXPERIMENTS[recipe.experiment].check_names(recipe)
                except ParameterError as error:
                    raise RefusedError(f"Line {line}: {error}.", field=error.field) from None


def _named(item: messages.LectureItem) -> str:
    """Return a fallback title for an unknown item."""
    name = item.lesson or item.failure or item.question
    return f"{item.kind.capitalize()} {name}" if name else item.kind.capitalize()


def _title_of(runs: Sequence[ComparedRun]) -> str:
    """Return a title for runs, from their experiments.

    Raises:
        RefusedError: An experiment is not installed.
        ParameterError: A run names a tracker or parameter that its experiment does not have.
    """
    titles = []
    for recipe in (run.recipe for run in runs if run.recipe is not None):
        experiment = find_experiment(recipe.experiment)
        experiment.check_names(recipe)
        titles.append(experiment.title)
    each = " and ".join(dict.fromkeys(titles)) or "Run of this server"
    return each if len(runs) == 1 else f"{each}, {len(runs)} runs compared"


def _session_page(run: messages.LectureRun) -> str:
    """Return the address of a new session.

    Raises:
        RefusedError: The run is given by name, as in a file written by hand.
    """
    if run.recipe is None:
        raise RefusedError("In a file, a session is given by its recipe; add the run on the lecture's page.")
    told = run.model_dump(mode="json", exclude_defaults=True, exclude_none=True)
    return _page("session/new", told)


def _page(path: str, told: object) -> str:
    """Return the address of a page with its content in the fragment, as `shared/share_link.js` reads it."""
    text = json.dumps(told, separators=(",", ":"))
    return f"{path}#{urlsafe_b64encode(text.encode()).decode().rstrip('=')}"
