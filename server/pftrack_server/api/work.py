"""My work: sessions, saved runs, comparisons, sweeps and uploads in one list, found by words."""

import asyncio
from collections.abc import Callable, Sequence, Sized
from datetime import datetime
from typing import Annotated, TypeVar
from zoneinfo import ZoneInfo

from fastapi import APIRouter, Query

from pftrack_server.api.dependencies import AManager, AStore, ASweeps
from pftrack_server.api.runs import run_view
from pftrack_server.comparisons.saved import saved_view
from pftrack_server.schemas.messages import SessionPublic
from pftrack_server.schemas.sweep_views import SweepPublic
from pftrack_server.schemas.uploads import UploadPublic
from pftrack_server.schemas.work import Kind, WorkCounts, WorkPublic
from pftrack_server.search import Words, date_words, experiment_words
from pftrack_server.store.tables import ComparisonRow, RunRow, UploadRow

router = APIRouter(prefix="/work", tags=["work"])

Thing = TypeVar("Thing", SessionPublic, RunRow, ComparisonRow, SweepPublic, UploadRow)
MOST = 500
UTC = ZoneInfo("UTC")


@router.get("")
async def find_work(
    manager: AManager,
    sweeps: ASweeps,
    store: AStore,
    q: Annotated[str, Query(max_length=200, description="Words that all have to occur: title, tracker, date ...")] = "",
    show: Annotated[Kind | None, Query(description="List things of this kind alone; the others are counted.")] = None,
    limit: Annotated[int, Query(ge=1, le=MOST, description="List so many of each kind.")] = 20,
    zone: Annotated[ZoneInfo, Query(description="The time zone in which dates are looked for.")] = UTC,
) -> WorkPublic:
    """Find sessions, saved runs, comparisons, sweeps and uploads by words, the newest first."""
    words = Words(q)
    now = datetime.now(zone)
    started = [session.view() for session in manager.all if session.spec.description]
    planned = [sweep.view() for sweep in sweeps.all]
    runs, uploads = await asyncio.gather(asyncio.to_thread(store.runs), asyncio.to_thread(store.uploads))
    kept = await asyncio.to_thread(store.comparisons)
    these = _having(words, now, started, _of_session)
    saved = _having(words, now, runs, _of_run)
    compared = _having(words, now, kept, _of_comparison)
    swept = _having(words, now, planned, _of_sweep)
    sent = _having(words, now, uploads, _of_upload)

    def most(kind: Kind) -> int:
        return limit if show in {None, kind} else 0

    return WorkPublic(
        sessions=these[: most("sessions")],
        runs=[run_view(row) for row in saved[: most("runs")]],
        comparisons=[saved_view(row) for row in compared[: most("comparisons")]],
        sweeps=swept[: most("sweeps")],
        uploads=[UploadPublic.model_validate(row) for row in sent[: most("uploads")]],
        found=_count(these, saved, compared, swept, sent),
        total=_count(started, runs, kept, planned, uploads),
    )


def _count(sessions: Sized, runs: Sized, comparisons: Sized, sweeps: Sized, uploads: Sized) -> WorkCounts:
    return WorkCounts(
        sessions=len(sessions), runs=len(runs), comparisons=len(comparisons), sweeps=len(sweeps), uploads=len(uploads)
    )


def _having(
    words: Words, now: datetime, things: Sequence[Thing], texts: Callable[[Thing], tuple[object, ...]]
) -> list[Thing]:
    return [thing for thing in things if words.occur_in(*texts(thing), date_words(thing.created, now))]


def _of_session(session: SessionPublic) -> tuple[object, ...]:
    kept = experiment_words(session.recipe.experiment, [session.tracker])
    return session.name, session.title, kept, f"seed {session.recipe.seed}", session.state


def _of_run(row: RunRow) -> tuple[object, ...]:
    return row.title, experiment_words(row.experiment, [row.tracker]), row.outcome, f"seed {row.seed}"


def _of_comparison(row: ComparisonRow) -> tuple[object, ...]:
    told = saved_view(row)
    return row.title, *(experiment_words(experiment, told.trackers) for experiment in told.experiments)


def _of_sweep(sweep: SweepPublic) -> tuple[object, ...]:
    methods = experiment_words(sweep.experiment, [tracker.id for tracker in sweep.trackers])
    return sweep.title, methods, sweep.outcome, sweep.state


def _of_upload(row: UploadRow) -> tuple[object, ...]:
    return row.name, row.kind
