"""The app: everything put together by one factory, so that a test can make its own."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import AsyncExitStack, asynccontextmanager

from fastapi import FastAPI

import pftrack
from pftrack.experiments import EXPERIMENTS
from pftrack_server.core.errors import ErrorBody
from pftrack_server.core.requests import BodyLimit
from pftrack_server.core.settings import Settings
from pftrack_server.sessions import routes as sessions
from pftrack_server.sweeps import routes as sweeps
from pftrack_server.teaching import routes as teaching
from pftrack_server.uploads import routes as uploads
from pftrack_server.web import experiments, failures, health, pages, scene
from pftrack_server.web.errors import install
from pftrack_server.web.health import Metrics, Stopwatch
from pftrack_server.web.middleware import BasePath, HeadAsGet
from pftrack_server.web.security import Guard
from pftrack_server.web.services import Services
from pftrack_server.work import routes as work

REST = (
    *(experiments.router, experiments.own_filters, health.compiling, work.source_code, uploads.router),
    *(sessions.router, work.jobs, work.router, work.uploads, failures.router, sweeps.router),
)
"""The REST interface and the streams: handlers of a few lines over typed dependencies, each next to its subject."""

PARTS = (teaching,)
"""Parts of the server besides its core; each installs its addresses and opens the services that they need."""

DESCRIPTION = (
    "Particle-filter tracking sessions. Every error has the shape {error: {message, field?, bound?, value?}}. "
    "Addresses in answers are relative to that of the server, which may lie below a base path."
)


def create_app(settings: Settings | None = None) -> FastAPI:
    """Return the app of a server.

    Args:
        settings: Its configuration; read from the environment by default.
    """
    settings = settings or Settings()
    metrics = Metrics()

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        # Imported now, so that the first request does not wait for it.
        await asyncio.to_thread(dict, EXPERIMENTS)
        app.state.services = services = Services(settings, metrics)
        await services.open()
        async with AsyncExitStack() as opened:
            opened.push_async_callback(services.close)
            for part in PARTS:
                await opened.enter_async_context(part.opened(services))
            yield

    app = FastAPI(
        title="pftrack",
        version=pftrack.__version__,
        description=DESCRIPTION,
        lifespan=lifespan,
        # Relative to the address of the description.
        servers=[{"url": "."}],
        root_path_in_servers=False,
        # Our own pages of the documentation work without a network.
        docs_url=None,
        redoc_url=None,
        responses={"4XX": {"model": ErrorBody}, "5XX": {"model": ErrorBody}},
    )
    install(app)
    for each in REST:
        app.include_router(each, prefix="/api/v1")
    for each in (health.router, scene.router):
        app.include_router(each)
    for part in (pages, *PARTS):
        part.install(app)
    # The last middleware added sees a request first.
    app.add_middleware(BodyLimit, most_bytes=settings.max_body_bytes)
    app.add_middleware(Guard, settings=settings)
    app.add_middleware(HeadAsGet)
    app.add_middleware(BasePath, settings=settings)
    app.add_middleware(Stopwatch, metrics=metrics)
    return app
