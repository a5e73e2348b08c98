"""Dependencies: what a handler may ask for."""

from collections.abc import Coroutine
from dataclasses import replace
from typing import Annotated, Any, Protocol, TypeVar

from fastapi import Depends, Path, Query, Request
from starlette.requests import HTTPConnection

from pftrack.experiments.experiment import Experiment
from pftrack_server.errors import NotFoundError, RefusedError
from pftrack_server.experiments import find_experiment
from pftrack_server.filters import FilterFiles
from pftrack_server.follow.follow import Follow
from pftrack_server.follow.follows import Follows
from pftrack_server.follow.participant import Participant, participant_of
from pftrack_server.jobs.child_tasks import ChildTasks, unless_gone
from pftrack_server.lectures.service import Lectures
from pftrack_server.lessons.service import Lessons
from pftrack_server.middleware.body_limit import lift_limit
from pftrack_server.schemas.spec import SessionSpec
from pftrack_server.services import Services
from pftrack_server.sessions.manager import Manager, Prepare
from pftrack_server.sessions.session import Session
from pftrack_server.settings import Settings
from pftrack_server.store import Store
from pftrack_server.store.tables import ComparisonRow, RunRow, UploadRow
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.sweeps.sweep import Sweep
from pftrack_server.work.explorations import Explorations
from pftrack_server.work.sources import House

Result = TypeVar("Result")


def _services(connection: HTTPConnection) -> Services:
    services: Services = connection.app.state.services
    return services


TheServices = Annotated[Services, Depends(_services)]


def _settings(services: TheServices) -> Settings:
    return services.settings


def _store(services: TheServices) -> Store:
    return services.store


def _manager(services: TheServices) -> Manager:
    return services.manager


def _sweeps(services: TheServices) -> Sweeps:
    return services.sweeps


def _filters(services: TheServices) -> FilterFiles:
    return services.filters


def _tasks(request: Request, services: TheServices) -> ChildTasks:
    return replace(services.tasks, gone=lambda: wait_until_gone(request))


async def wait_until_gone(request: Request) -> None:
    """Wait until the client of a request whose body has been read hangs up."""
    while (await request.receive())["type"] != "http.disconnect":
        pass


async def unless_client_gone(request: Request, work: Coroutine[Any, Any, Result]) -> Result:
    """Return what work comes to, and cancel it once its client hangs up."""
    return await unless_gone(work, lambda: wait_until_gone(request))


class Begins(Protocol):
    """Start a session for a client."""

    async def __call__(self, spec: SessionSpec, prepare: Prepare | None = None) -> Session:
        """Return the session, prepared; where that fails or nobody waits any more, there is none."""


def _begin(request: Request, manager: Annotated[Manager, Depends(_manager)]) -> Begins:
    async def begin(spec: SessionSpec, prepare: Prepare | None = None) -> Session:
        return await unless_client_gone(request, manager.create(spec, prepare))

    return begin


Begin = Annotated[Begins, Depends(_begin)]
"""Starts a session for a client: one that hangs up meanwhile could not know of it, so it is ended."""


def _takes_files(request: Request) -> None:
    lift_limit(request.scope)


TakesFiles = Depends(_takes_files)
"""For a route whose handler reads files from the wire, with limits of their own."""

TICKET = r"^[0-9A-Za-z-]{8,64}$"
Ticket = Annotated[
    str | None, Query(pattern=TICKET, description="A name chosen by the client, to ask for the place in the queue")
]


def _house(services: TheServices) -> House:
    return services.house


def _explorations(services: TheServices) -> Explorations:
    return services.explorations


def _lessons(services: TheServices) -> Lessons:
    return services.lessons


def _lectures(services: TheServices) -> Lectures:
    return services.lectures


def _follows(services: TheServices) -> Follows:
    return services.follows


SettingsNow = Annotated[Settings, Depends(_settings)]
AStore = Annotated[Store, Depends(_store)]
AManager = Annotated[Manager, Depends(_manager)]
ASweeps = Annotated[Sweeps, Depends(_sweeps)]
TheTasks = Annotated[ChildTasks, Depends(_tasks)]
TheFilters = Annotated[FilterFiles, Depends(_filters)]
TheHouse = Annotated[House, Depends(_house)]
TheLectures = Annotated[Lectures, Depends(_lectures)]
TheExplorations = Annotated[Explorations, Depends(_explorations)]
TheLessons = Annotated[Lessons, Depends(_lessons)]
TheFollows = Annotated[Follows, Depends(_follows)]


def _experiment(experiment: Annotated[str, Path(max_length=64)]) -> Experiment:
    try:
        return find_experiment(experiment)
    except RefusedError as error:
        raise NotFoundError(str(error)) from None


async def _session(session: Annotated[str, Path(max_length=64)], manager: AManager) -> Session:
    return manager.get(session)


async def _sweep(sweep: Annotated[str, Path(max_length=64)], sweeps: ASweeps) -> Sweep:
    return sweeps.get(sweep)


def _upload(upload: Annotated[str, Path(max_length=64)], store: AStore) -> UploadRow:
    row = store.get(UploadRow, upload)
    if row is None:
        raise NotFoundError("There is no such upload; it may have been deleted.")
    return row


def _run(run: Annotated[str, Path(max_length=64)], store: AStore) -> RunRow:
    row = store.get(RunRow, run)
    if row is None:
        raise NotFoundError("There is no such run; it may have been deleted.")
    return row


def _comparison(saved: Annotated[str, Path(max_length=64)], store: AStore) -> ComparisonRow:
    row = store.get(ComparisonRow, saved)
    if row is None:
        raise NotFoundError("There is no such comparison; it may have been deleted.")
    return row


def _follow(follow: Annotated[str, Path(max_length=64)], follows: TheFollows) -> Follow:
    return follows.get(follow)


def _follower(connection: HTTPConnection) -> Participant:
    participant = participant_of(connection.scope)
    if participant is None:
        raise NotFoundError("This address belongs to followers; open the link of the class.")
    return participant


AComparison = Annotated[ComparisonRow, Depends(_comparison)]
AFollow = Annotated[Follow, Depends(_follow)]
AFollower = Annotated[Participant, Depends(_follower)]
AnExperiment = Annotated[Experiment, Depends(_experiment)]
ASession = Annotated[Session, Depends(_session)]
ASweep = Annotated[Sweep, Depends(_sweep)]
AnUpload = Annotated[UploadRow, Depends(_upload)]
ARun = Annotated[RunRow, Depends(_run)]
