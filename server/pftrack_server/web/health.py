"""Health: is the server alive, can it work, and what has it done."""

import asyncio
from typing import Annotated

from fastapi import APIRouter
from prometheus_client import CONTENT_TYPE_LATEST
from starlette.responses import Response

from pftrack_server.core.compilation import Compilation
from pftrack_server.core.errors import UnavailableError
from pftrack_server.core.requests import service
from pftrack_server.jobs.child_tasks import ChildTasks
from pftrack_server.store.store import AStore
from pftrack_server.web.metrics import Metrics

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """Tell that the server is alive."""
    return {"status": "ok"}


@router.get("/readyz")
async def ready(
    store: AStore,
    tasks: Annotated[ChildTasks, service(ChildTasks)],
    compilation: Annotated[Compilation, service(Compilation)],
) -> dict[str, str]:
    """Tell that the server can start sessions: all is compiled, what is made can be kept, and workers can be made."""
    compiling = compilation.progress
    if not compiling.finished:
        raise UnavailableError(f"The server is not ready: {compiling.sentence}.")
    try:
        await asyncio.to_thread(store.check)
        await tasks.check()
    except Exception as error:
        raise UnavailableError(
            "The server is not ready; its data directory, its database or its workers fail."
        ) from error
    return {"status": "ready"}


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
async def show_metrics(metrics: Annotated[Metrics, service(Metrics)]) -> Response:
    """Return the server's metrics for Prometheus."""
    return Response(metrics.text(), media_type=CONTENT_TYPE_LATEST)
