"""The lectures of a server: kept as their files, and read when they are asked for."""

import asyncio

from pftrack.core.refusal import ConflictError, RefusedError
from pftrack_server.core.errors import DamagedError, NotFoundError
from pftrack_server.lectures.file import LectureText, read, write
from pftrack_server.lectures.items import ItemViews, check_names
from pftrack_server.lessons.service import Lessons
from pftrack_server.schemas.lectures import (
    LectureItem,
    LecturePublic,
    LectureRun,
    LectureSummary,
    LectureUpdate,
)
from pftrack_server.store import Store
from pftrack_server.store.files import new_name, now
from pftrack_server.store.tables import LectureRow
from pftrack_server.work.sources import ComparedRun, House, find_run

MOST = 200
"""Lectures kept."""


class Lectures:
    """The lectures of a server.

    Args:
        house: Where runs can be, which items may name.
        lessons: Which items may name.
    """

    def __init__(self, house: House, lessons: Lessons) -> None:
        self._house = house
        self._store: Store = house.store
        self._views = ItemViews(lessons)

    async def all(self) -> list[LectureSummary]:
        """Return all lectures, the newest first."""
        found = await asyncio.to_thread(lambda: [(row, _readable(row)) for row in self._store.all(LectureRow)])
        return [_summary(await self._public(row, text)) for row, text in found if text is not None]

    async def get(self, name: str) -> LecturePublic:
        """Return a lecture.

        Raises:
            DamagedError: What is stored cannot be read.
            NotFoundError: There is none.
        """
        row = await self._row(name)
        text = await asyncio.to_thread(_readable, row)
        if text is None:
            raise DamagedError("The stored file of this lecture is damaged; it can only be deleted.")
        return await self._public(row, text)

    async def text(self, name: str) -> tuple[str, str]:
        """Return title and file of a lecture.

        Raises:
            NotFoundError: There is none.
        """
        row = await self._row(name)
        return row.title, row.text

    async def add(self, lecture: LectureUpdate) -> LecturePublic:
        """Keep a new lecture.

        Raises:
            ConflictError: There are as many as there may be.
            NotFoundError: A run that it names is not here.
            RefusedError: It is too large.
        """
        return await self._keep(await asyncio.to_thread(write, await self._self_contained(lecture)))

    async def bring_in(self, data: bytes) -> LecturePublic:
        """Keep a lecture that somebody wrote or sent, as it was written; items not found here are told by their line.

        Raises:
            ConflictError: There are as many as there may be.
            RefusedError: It is no lecture.
        """
        await asyncio.to_thread(read, data)
        return await self._keep(data.decode("utf-8-sig"))

    async def change(self, name: str, lecture: LectureUpdate) -> LecturePublic:
        """Put another order in the place of a lecture's.

        Raises:
            NotFoundError: There is no such lecture, or a run that it names is not here.
            RefusedError: It is too large.
        """
        row = await self._row(name)
        text = await asyncio.to_thread(write, await self._self_contained(lecture))
        return await self._save(LectureRow(id=name, title=lecture.title, text=text, created=row.created, updated=now()))

    async def remove(self, name: str) -> None:
        """Forget a lecture; what was answered in it stays.

        Raises:
            NotFoundError: There is none.
        """
        if not await asyncio.to_thread(self._store.remove, LectureRow, name):
            raise NotFoundError("There is no such lecture; it may have been deleted.")

    # ------------------------------------------------------------ within

    async def _keep(self, text: str) -> LecturePublic:
        if await asyncio.to_thread(self._store.count, LectureRow) >= MOST:
            raise ConflictError(f"The server keeps at most {MOST} lectures; delete one first.")
        lecture, _ = await asyncio.to_thread(read, text.encode())
        moment = now()
        return await self._save(
            LectureRow(id=new_name(), title=lecture.title, text=text, created=moment, updated=moment)
        )

    async def _save(self, row: LectureRow) -> LecturePublic:
        text = await asyncio.to_thread(read, row.text.encode())
        check_names(text.lecture.items, text.lines)
        public = await self._public(row, text)
        await asyncio.to_thread(self._store.save, row)
        return public

    async def _row(self, name: str) -> LectureRow:
        row = await asyncio.to_thread(self._store.get, LectureRow, name)
        if row is None:
            raise NotFoundError("There is no such lecture; it may have been deleted.")
        return row

    async def _public(self, row: LectureRow, text: LectureText) -> LecturePublic:
        lecture, lines = text
        items = await self._views.of(lecture.items, lines, row.id)
        return LecturePublic(
            id=row.id,
            title=lecture.title,
            count=len(items),
            minutes=sum(item.minutes for item in items),
            created=row.created,
            updated=row.updated,
            page=f"lectures/{row.id}",
            items=items,
            notes=lecture.notes,
        )

    async def _self_contained(self, lecture: LectureUpdate) -> LectureUpdate:
        """Return a lecture whose runs are what makes them, so that its file says all, wherever it is opened."""
        return lecture.model_copy(update={"items": [await self._with_recipes(item) for item in lecture.items]})

    async def _with_recipes(self, item: LectureItem) -> LectureItem:
        titles: list[str | None] = []
        update: dict[str, object] = {}
        if item.session is not None and item.session.reference is not None:
            named = await find_run(item.session, self._house)
            given = item.session.position
            position = named.spec.run.position if given is None else given
            recipe = named.spec.recipe.with_footage(truth=None)
            update["session"] = LectureRun(recipe=recipe, upload=named.spec.upload, position=position or None)
            titles.append(named.title)
        if item.comparison is not None:
            runs = []
            for run in item.comparison.runs:
                if run.reference is None:
                    runs.append(run)
                    titles.append(None)
                    continue
                named = await find_run(run, self._house)
                runs.append(ComparedRun(recipe=named.spec.recipe, upload=named.spec.upload))
                titles.append(named.title)
            update["comparison"] = item.comparison.model_copy(update={"runs": runs})
        known = [title for title in titles if title]
        if item.title is None and known and len(known) == len(titles):
            update["title"] = " · ".join(known)[:200]
        return item.model_copy(update=update)


def _readable(row: LectureRow) -> LectureText | None:
    """Return what a stored file says; None if it cannot be read any more."""
    try:
        return read(row.text.encode())
    except RefusedError:
        return None


def _summary(lecture: LecturePublic) -> LectureSummary:
    return LectureSummary(**{name: getattr(lecture, name) for name in LectureSummary.model_fields})
