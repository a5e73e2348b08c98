"""Health: liveness, readiness, progress of compiling, and metrics for Prometheus."""

import asyncio
from functools import partial
from http import HTTPStatus
from typing import Annotated, get_args

from fastapi import APIRouter
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, Counter, Gauge, Histogram, generate_latest
from pydantic import AfterValidator, BaseModel, Field
from starlette.responses import Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.errors import unavailable
from pftrack_server.core.requests import service
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.sessions.manager import Manager
from pftrack_server.sessions.spec import Phase
from pftrack_server.store.store import AStore
from pftrack_server.sweeps.manager import Sweeps
from pftrack_server.sweeps.sweep import State

METHODS = {"GET", "HEAD", "POST", "PUT", "PATCH", "DELETE"}


class Metrics:
    """The counters of one server, with a registry of their own, so that tests can make many."""

    def __init__(self) -> None:
        self.registry = CollectorRegistry()
        self.requests = Counter("pftrack_requests", "Requests answered", ["method", "status"], registry=self.registry)
        self.seconds = Histogram("pftrack_request_seconds", "Time to answer a request", registry=self.registry)

    def watch(self, manager: Manager, sweeps: Sweeps) -> None:
        """Report a server's sessions and sweeps from now on, as they are at each request."""

        def count_sessions(phase: Phase) -> int:
            return sum(it.phase == phase for it in manager.all)

        def count_sweeps(state: str) -> int:
            return sum(it.row.state == state for it in sweeps.all)

        gauge = partial(Gauge, registry=self.registry)
        sessions = gauge("pftrack_sessions", "Sessions by state", ["state"])
        for phase in Phase:
            sessions.labels(phase).set_function(partial(count_sessions, phase))
        visitors = gauge("pftrack_visitors", "Connections to scenes and streams of sessions")
        visitors.set_function(lambda: sum(it.visitors for it in manager.all))
        frames = gauge("pftrack_frames", "Frames computed by all workers since the server started")
        frames.set_function(lambda: sum(it.frames_computed for it in manager.all))
        kept = gauge("pftrack_sweeps", "Sweeps by state", ["state"])
        for state in get_args(State):
            kept.labels(state).set_function(partial(count_sweeps, state))
        runs = gauge("pftrack_sweep_runs", "Computed runs of all stored sweeps")
        runs.set_function(lambda: sum(it.row.done for it in sweeps.all))
        visitors = gauge("pftrack_sweep_visitors", "Connections that watch a sweep")
        visitors.set_function(lambda: sum(it.listeners for it in sweeps.all))

    def text(self) -> bytes:
        """Return everything in Prometheus's own format."""
        return generate_latest(self.registry)


class Stopwatch:
    """ASGI middleware that counts and times every answer."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._metrics = metrics

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Time one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        status = int(HTTPStatus.INTERNAL_SERVER_ERROR)

        async def note(message: Message) -> None:
            nonlocal status
            if message["type"] == "http.response.start":
                status = message["status"]
            await send(message)

        try:
            with self._metrics.seconds.time():
                await self._app(scope, receive, note)
        finally:
            # A method invented by a client must not become a label.
            method = scope["method"] if scope["method"] in METHODS else "other"
            self._metrics.requests.labels(method, str(status)).inc()


router = APIRouter(tags=["health"])


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """Report that the server is alive."""
    return {"status": "ok"}


@router.get("/readyz")
async def ready(
    store: AStore,
    tasks: Annotated[ChildTasks, service(ChildTasks)],
    compilation: Annotated[Compilation, service(Compilation)],
) -> dict[str, str]:
    """Report whether the server can start sessions: code is compiled, the store is writable, and workers start."""
    compiling = compilation.progress
    if not compiling.finished:
        raise unavailable(f"The server is not ready: {compiling.sentence}.")
    try:
        await asyncio.to_thread(store.check)
        await tasks.check()
    except Exception as error:
        raise unavailable("The server is not ready; its data directory, database or workers fail.") from error
    return {"status": "ready"}


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
async def show_metrics(metrics: Annotated[Metrics, service(Metrics)]) -> Response:
    """Return the server's metrics for Prometheus."""
    return Response(metrics.text(), media_type=CONTENT_TYPE_LATEST)


compiling = APIRouter(prefix="/compilation", tags=["health"])

Names = Annotated[list[str], AfterValidator(sorted)]


class CompilationPublic(BaseModel):
    """Progress of compiling, which is needed once after an installation or an update."""

    finished: bool
    sentence: str = Field(description='In words: "compiling, 14 of 41 functions, about 40 s on an idle machine"')
    done: int = Field(description="Number of compiled functions")
    total: int = Field(description="Number of functions; 0 while unknown")
    seconds_left: float | None = Field(
        validation_alias="left_s", description="Seconds left on an idle machine; null if unknown"
    )
    usable: Names = Field(description="Experiments ready to start")
    ready: Names = Field(description="Experiments compiled whole")


@compiling.get("")
def show_compilation(compilation: Annotated[Compilation, service(Compilation)]) -> CompilationPublic:
    """Return the progress of compiling, which is needed once after an installation or an update."""
    return CompilationPublic.model_validate(compilation.progress, from_attributes=True)
