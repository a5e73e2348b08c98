"""Pages: plain files, whose content comes from the REST interface.

Three things are done to a page when it is served. It is told where the server is, as its `<base>`, since all addresses
in pages and scripts are relative to that. The names of all modules that its scripts import, directly or through other
modules, are added: a browser then fetches them at once, instead of finding each level of imports in the level above.
And its files are named with their version, so that a browser which has them need not ask for a hundred of them whether
they have changed.
"""

import asyncio
import hashlib
import html
import re
import shlex
import sys
from collections.abc import Mapping
from functools import partial
from http import HTTPStatus
from pathlib import Path

from fastapi import APIRouter, FastAPI, Request
from starlette.responses import HTMLResponse, RedirectResponse, Response
from starlette.staticfiles import StaticFiles
from starlette.types import Scope

from pftrack.experiments import EXPERIMENTS
from pftrack_server.core.base_path import address_of, guest_of
from pftrack_server.core.frontend import DOCS, FRONTEND, HELP, modules_of
from pftrack_server.web.documentation import html_of, reference

STATIC = "static/"
YEAR_S = 365 * 24 * 3600
VERSIONS: set[str] = set()
"""Those of the pages that were served: one, unless somebody works at them meanwhile."""
SCRIPT = re.compile(r'<script type="module"[^>]* src="static/([^"]+)"')
MAIN = re.compile(r'(?<=<main class="help">).*(?=</main>)', re.DOTALL)

PAGES = {
    "/work": "work/work.html",
    "/references": "references/references.html",
    "/glossary": "glossary/glossary.html",
    "/failures": "failures/failures.html",
    "/failures/{failure}": "failures/failure.html",
    "/compare": "compare/compare.html",
    "/session/{session}": "session/session.html",
    "/sweep/new": "sweep/new.html",
    "/sweep/{sweep}": "sweep/sweep.html",
    "/sweep/{sweep}/run/{run}": "sweep/run.html",
}
"""The file of each page that is served as it is; the page of one thing finds out by itself whether there is one."""

EXAMPLES = "media/"
EXAMPLES_POLICY = "sandbox allow-scripts allow-downloads; frame-ancestors 'self'"
"""Of runs that are pages of their own: their scripts stand in them, and may do nothing to the server."""

CAMERA_POLICY = {"Permissions-Policy": "camera=(self), microphone=(), geolocation=()"}
"""Of the page on which a clip can be recorded; no other may use the camera."""

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
async def gallery(request: Request) -> Response:
    """Return the start page: where to begin, also with a clip from the camera, and all experiments."""
    start = page(request, "gallery/gallery.html", about=f'data-commands="{html.escape(_commands())}"')
    start.headers.update(CAMERA_POLICY)
    return start


@router.get("/docs")
def rest_reference(request: Request) -> Response:
    """Return the reference of the REST interface; Swagger's page comes from elsewhere, which our policy forbids."""
    return page(request, "help/help.html", content=reference(request.app.openapi()))


@router.get("/help")
async def documentation_start(request: Request) -> Response:
    """Lead to the documentation, whose links are relative to its folder."""
    return RedirectResponse(address_of(request.scope, "help/"))


@router.get("/help/{path:path}")
async def documentation(request: Request, path: str) -> Response:
    """Return a page or picture of the documentation: of its site, or of its Markdown until that has been built.

    Where there is neither, its first page says how to build it.
    """
    path = path or "index.html"
    is_built = (HELP / "index.html").is_file()
    if not is_built and (text := await asyncio.to_thread(html_of, path)):
        return page(request, "help/help.html", content=text)
    if not is_built and path == "index.html":
        return page(request, "help/help.html", HTTPStatus.NOT_FOUND)
    files = StaticFiles(directory=HELP if is_built else DOCS, html=True, check_dir=False)
    answer = await files.get_response(path, request.scope)
    answer.headers["Cache-Control"] = "no-cache"
    if path.startswith(EXAMPLES) and path.endswith(".html"):
        answer.headers["Content-Security-Policy"] = EXAMPLES_POLICY
    return answer


async def _serve(name: str, request: Request) -> Response:
    return page(request, name)


def add_pages(router: APIRouter, pages: Mapping[str, str]) -> None:
    """Add pages that are served as they are: the file of each by its address."""
    for address, name in pages.items():
        router.add_api_route(address, partial(_serve, name))


add_pages(router, PAGES)


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


def _commands() -> str:
    """Return what begins a filter of one's own, for the shell that started the server, which may go on meanwhile."""
    program = Path(sys.argv[0])
    # Started by its path in a folder, as by `make serve`; else the shell has found it by its name.
    is_beside = program.name == "pftrack" and not program.is_absolute()
    path = f'export PATH="$PWD"/{shlex.quote(str(program.parent))}:"$PATH"\n' if is_beside else ""
    return (
        f"{path}pftrack new filter my_filter.py --experiment {next(iter(EXPERIMENTS))}\n"
        "pftrack serve my_filter.py --port 0 --data-dir my_filter_data"
    )


def page(request: Request, name: str, status: int = HTTPStatus.OK, *, content: str = "", about: str = "") -> Response:
    """Return a page, told where the server is and what its scripts import.

    Args:
        request: For it.
        name: Of its file.
        status: Of the answer.
        content: HTML for its main part.
        about: Attributes of its root.
    """
    text = (FRONTEND / name).read_text(encoding="utf-8")
    if content:
        text = MAIN.sub(lambda _: content, text)
    base = f'<base href="{html.escape(address_of(request.scope))}">\n'
    modules = modules_of(*SCRIPT.findall(text))
    links = "".join(f'<link rel="modulepreload" href="{STATIC}{module}">\n' for module in modules)
    text = text.replace("<head>\n", f"<head>\n{base}", 1).replace("</head>", f"{links}</head>", 1)
    text = text.replace(f'"{STATIC}', f'"{STATIC}version/{_version()}/')
    if guest := guest_of(request.scope):
        about = guest.about
    if about:
        text = text.replace("<html ", f"<html {about} ", 1)
    return HTMLResponse(text, status, headers={"Cache-Control": "no-cache"})
