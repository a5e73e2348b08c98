"""Pages: plain files, served as they are; what they show they ask from the REST interface."""

import importlib.util
from pathlib import Path

from fastapi import APIRouter, FastAPI
from starlette.responses import FileResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

__all__ = ["install"]

FRONTEND = Path(__file__).parents[1] / "frontend_static"

router = APIRouter(include_in_schema=False)


class Files(StaticFiles):
    """Static files that a browser asks for again each time, and gets again only when they have changed."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return a file, to be asked for again."""
        answer = await super().get_response(path, scope)
        answer.headers["Cache-Control"] = "no-cache"
        return answer


@router.get("/")
async def gallery() -> Response:
    """Return the gallery of experiments."""
    return _page("index.html")


@router.get("/session/{session}")
async def session(session: str) -> Response:
    """Return the page of a session, which finds out by itself whether there is one."""
    del session
    return _page("session.html")


@router.get("/sweep/new")
async def new_sweep() -> Response:
    """Return the form of a new sweep."""
    return _page("sweep_new.html")


@router.get("/sweep/{sweep}")
async def sweep(sweep: str) -> Response:
    """Return the page of a sweep, which finds out by itself whether there is one."""
    del sweep
    return _page("sweep.html")


@router.get("/sweep/{sweep}/run/{run}")
async def sweep_run(sweep: str, run: str) -> Response:
    """Return the page that opens a run of a sweep as a session."""
    del sweep, run
    return _page("sweep_run.html")


def install(app: FastAPI) -> None:
    """Add the pages and their files to an app."""
    app.include_router(router)
    app.mount("/static/bokeh", Files(directory=_bokeh()), name="bokeh")
    app.mount("/static", Files(directory=FRONTEND), name="static")


def _bokeh() -> Path:
    """Return where BokehJS lies in Bokeh's wheel, without importing Bokeh, which takes half a second."""
    spec = importlib.util.find_spec("bokeh")
    if spec is None or spec.origin is None:
        raise RuntimeError("bokeh is not installed; the pages draw their plots with its BokehJS")
    return Path(spec.origin).parent / "server" / "static" / "js"


def _page(name: str) -> Response:
    return FileResponse(FRONTEND / name, media_type="text/html; charset=utf-8", headers={"Cache-Control": "no-cache"})
