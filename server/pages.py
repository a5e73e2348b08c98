"""Pages: plain files, whose content comes from the REST interface.

Only one thing is added to a page when it is served: the names of all modules that its scripts import, directly or
through other modules. A browser then fetches them at once, instead of finding each level of imports in the level above.
"""

import importlib.util
import re
from functools import lru_cache
from pathlib import Path

from fastapi import APIRouter, FastAPI
from starlette.responses import HTMLResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

__all__ = ["install"]

FRONTEND = Path(__file__).parents[1] / "frontend_static"
STATIC = "/static/"
SCRIPT = re.compile(r'<script type="module"[^>]* src="/static/([^"]+)"')
IMPORT = re.compile(r'^(?:import|export)\b[^"\';]*?\s*["\'](\.[^"\']+)["\'];', re.MULTILINE)

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
    return _page("gallery/gallery.html")


@router.get("/references")
async def references() -> Response:
    """Return the page of what the experiments come from."""
    return _page("references/references.html")


@router.get("/session/{session}")
async def session(session: str) -> Response:
    """Return the page of a session, which finds out by itself whether there is one."""
    del session
    return _page("session/session.html")


@router.get("/sweep/new")
async def new_sweep() -> Response:
    """Return the form of a new sweep."""
    return _page("sweep/new.html")


@router.get("/sweep/{sweep}")
async def sweep(sweep: str) -> Response:
    """Return the page of a sweep, which finds out by itself whether there is one."""
    del sweep
    return _page("sweep/sweep.html")


@router.get("/sweep/{sweep}/run/{run}")
async def sweep_run(sweep: str, run: str) -> Response:
    """Return the page that opens a run of a sweep as a session."""
    del sweep, run
    return _page("sweep/run.html")


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
    text = (FRONTEND / name).read_text(encoding="utf-8")
    links = "".join(f'<link rel="modulepreload" href="{STATIC}{module}">\n' for module in _modules(name))
    return HTMLResponse(text.replace("</head>", f"{links}</head>", 1), headers={"Cache-Control": "no-cache"})


@lru_cache
def _modules(page: str) -> tuple[str, ...]:
    """Return the modules that a page's scripts consist of, each script before what it imports."""
    scripts = SCRIPT.findall((FRONTEND / page).read_text(encoding="utf-8"))
    found: dict[str, None] = {}
    waiting = list(reversed(scripts))
    while waiting:
        module = waiting.pop()
        if module in found:
            continue
        found[module] = None
        path = FRONTEND / module
        imported = IMPORT.findall(path.read_text(encoding="utf-8"))
        waiting += [
            (path.parent / other).resolve().relative_to(FRONTEND.resolve()).as_posix() for other in reversed(imported)
        ]
    return tuple(found)
