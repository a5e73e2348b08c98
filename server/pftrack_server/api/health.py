"""Health: is the server alive, can it work, and what has it done."""

import asyncio

from fastapi import APIRouter
from prometheus_client import CONTENT_TYPE_LATEST
from starlette.responses import Response

from pftrack_server.api.dependencies import AStore, TheServices
from pftrack_server.errors import UnavailableError

router = APIRouter(tags=["health"])


@router.get("/healthz")
async def alive() -> dict[str, str]:
    """Tell that the server is alive."""
    return {"status": "ok"}


@router.get("/readyz")
async def ready(store: AStore, services: TheServices) -> dict[str, str]:
    """Tell that the server can start sessions: all is compiled, what is made can be kept, and workers can be made."""
    compiling = services.compilation.progress
    if not compiling.finished:
        raise UnavailableError(f"The server is not ready: {compiling.sentence}.")
    try:
        await asyncio.to_thread(store.check)
        await services.tasks.check()
    except Exception as error:
        raise UnavailableError(
            "The server is not ready; its data directory, its database or its workers fail."
        ) from error
    return {"status": "ready"}


@router.get("/metrics", response_class=Response, responses={200: {"content": {"text/plain": {}}}})
async def metrics(services: TheServices) -> Response:
    """Return the server's metrics for Prometheus."""
    return Response(services.metrics.text(), media_type=CONTENT_TYPE_LATEST)
