"""Pages: plain files, whose content comes from the REST interface.

Two things are done to a page when it is served. The names of all modules that its scripts import, directly or through
other modules, are added: a browser then fetches them at once, instead of finding each level of imports in the level
above. And its files are named with their version, so that a browser which has them need not ask for a hundred of them
whether they have changed.
"""

import hashlib
import re
from functools import lru_cache
from http import HTTPStatus

from fastapi import APIRouter, FastAPI, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from pftrack_server.api.dependencies import AFollower, TheLessons
from pftrack_server.errors import NotFoundError
from pftrack_server.follow.participant import Participant, participant_of
from pftrack_server.frontend import FRONTEND

__all__ = ["install"]

STATIC = "/static/"
YEAR_S = 365 * 24 * 3600
VERSIONS: set[str] = set()
"""Those of the pages that were served: one, unless somebody works at them meanwhile."""
SCRIPT = re.compile(r'<script type="module"[^>]* src="/static/([^"]+)"')
IMPORT = re.compile(r'^(?:import|export)\b[^"\';]*?\s*["\'](\.[^"\']+)["\'];', re.MULTILINE)

router = APIRouter(include_in_schema=False)


class Files(StaticFiles):
    """Static files: with a version in its name one never changes; for others a browser asks each time."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return a file, to be kept or to be asked for again."""
        answer = await super().get_response(path, scope)
        lasting = scope["path_params"].get("version") in VERSIONS
        answer.headers["Cache-Control"] = f"max-age={YEAR_S}, immutable" if lasting else "no-cache"
        return answer


@router.get("/")
async def gallery() -> Response:
    """Return the start page: where to begin, and all experiments."""
    return _page("gallery/gallery.html")


@router.get("/work")
async def work() -> Response:
    """Return the page of one's own sessions, runs, sweeps and uploads."""
    return _page("work/work.html")


@router.get("/references")
async def references() -> Response:
    """Return the page of what the experiments come from."""
    return _page("references/references.html")


@router.get("/learn")
async def learn() -> Response:
    """Return the overview of the lessons."""
    return _page("learn/learn.html")


@router.get("/learn/{lesson}")
async def lesson(request: Request, lesson: str, lessons: TheLessons) -> Response:
    """Return the page of a lesson, which says so if there is none; a number leads to the lesson of that number."""
    try:
        found = await lessons.get(lesson)
    except NotFoundError as error:
        return _page("learn/lesson.html", error.status)
    return (
        _page("learn/lesson.html", participant=participant_of(request.scope))
        if found.id == lesson
        else RedirectResponse(f"/learn/{found.id}")
    )


@router.get("/failures")
async def failures() -> Response:
    """Return the gallery of failures."""
    return _page("failures/failures.html")


@router.get("/failures/{failure}")
async def failure(failure: str) -> Response:
    """Return the page of a failure, which finds out by itself whether there is one."""
    del failure
    return _page("failures/failure.html")


@router.get("/compare")
async def compare() -> Response:
    """Return the page on which runs stand beside each other."""
    return _page("compare/compare.html")


@router.get("/session/{session}")
async def session(request: Request, session: str) -> Response:
    """Return the page of a session, which finds out by itself whether there is one."""
    del session
    return _page("session/session.html", participant=participant_of(request.scope))


@router.get("/follow")
async def follow(participant: AFollower) -> Response:
    """Return the page of those who follow."""
    return _page("follow/follow.html", participant=participant)


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
    for place in ("/static/version/{version}", "/static"):
        app.mount(place, Files(directory=FRONTEND))


def _version() -> str:
    """Return what tells the files as they are now from others of the same names: sizes and times."""
    digest = hashlib.sha256()
    for path in sorted(FRONTEND.rglob("*")):
        status = path.stat()
        digest.update(f"{path} {status.st_size} {status.st_mtime_ns}\n".encode())
    VERSIONS.add(name := digest.hexdigest()[:16])
    return name


def _page(name: str, status: int = HTTPStatus.OK, *, participant: Participant | None = None) -> Response:
    prefix = participant.prefix if participant else ""
    text = (FRONTEND / name).read_text(encoding="utf-8")
    links = "".join(f'<link rel="modulepreload" href="{STATIC}{module}">\n' for module in _modules(name))
    text = text.replace("</head>", f"{links}</head>", 1).replace(
        f'"{STATIC}', f'"{prefix}{STATIC}version/{_version()}/'
    )
    if participant:
        about = f'data-role="{participant.claim.role}" data-class="{participant.claim.follow}"'
        text = text.replace("<html ", f"<html {about} ", 1)
    return HTMLResponse(text, status, headers={"Cache-Control": "no-cache"})


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
