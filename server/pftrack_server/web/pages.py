"""Pages: plain files that get their content from the REST interface.

A page is changed in three ways when it is served. It gets the server's address as its `<base>`, to which all addresses
in pages and scripts are relative. It gets links to all modules that its scripts import, directly or indirectly: a
browser then fetches them at once, instead of level by level. And its files are named with their version, so that a
browser need not ask for each of a hundred files whether it has changed.
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
"""Versions of the pages' files that were served: one, unless the files change meanwhile."""
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
"""The file of each page, by its address; a page about one item checks by itself whether the item exists."""

EXAMPLES = "media/"
EXAMPLES_POLICY = "sandbox allow-scripts allow-downloads; frame-ancestors 'self'"
"""Content policy of exported runs: their inline scripts must not reach the server."""

CAMERA_POLICY = {"Permissions-Policy": "camera=(self), microphone=(), geolocation=()"}
"""Permissions of the page that can record a clip; no other page may use the camera."""

router = APIRouter(include_in_schema=False)


class Files(StaticFiles):
    """Static files: one with a version in its name never changes; a browser revalidates others each time."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        """Return a file with its caching headers."""
        answer = await super().get_response(path, scope)
        lasting = scope["path_params"].get("version") in VERSIONS
        answer.headers["Cache-Control"] = f"max-age={YEAR_S}, immutable" if lasting else "no-cache"
        return answer


@router.get("/")
async def gallery(request: Request) -> Response:
    """Return the start page, with all experiments; it may also record a clip with the camera."""
    start = page(request, "gallery/gallery.html", about=f'data-commands="{html.escape(_commands())}"')
    start.headers.update(CAMERA_POLICY)
    return start


@router.get("/docs")
def rest_reference(request: Request) -> Response:
    """Return the reference of the REST interface; our policy forbids Swagger's page, which loads other sites."""
    return page(request, "help/help.html", content=reference(request.app.openapi()))


@router.get("/help")
async def documentation_start(request: Request) -> Response:
    """Redirect to the documentation, whose links are relative to its folder."""
    return RedirectResponse(address_of(request.scope, "help/"))


@router.get("/help/{path:path}")
async def documentation(request: Request, path: str) -> Response:
    """Return a page or picture of the documentation: from its site, or from its Markdown if that is not built.

    If there is neither, its first page says how to build it.
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
    """Add pages by their address and file."""
    for address, name in pages.items():
        router.add_api_route(address, partial(_serve, name))


add_pages(router, PAGES)


def install(app: FastAPI) -> None:
    """Add the pages and their files to an app."""
    app.include_router(router)
    for place in ("/static/version/{version}", "/static"):
        app.mount(place, Files(directory=FRONTEND))


def _version() -> str:
    """Return a version of the pages' files, from their sizes and times."""
    digest = hashlib.sha256()
    for path in sorted(FRONTEND.rglob("*")):
        status = path.stat()
        digest.update(f"{path} {status.st_size} {status.st_mtime_ns}\n".encode())
    VERSIONS.add(name := digest.hexdigest()[:16])
    return name


def _commands() -> str:
    """Return the commands that begin an own filter, for the shell that started this server, which may keep running."""
    program = Path(sys.argv[0])
    # Started by a path, as by `make serve`; otherwise the shell found the command by its name.
    is_beside = program.name == "pftrack" and not program.is_absolute()
    path = f'export PATH="$PWD"/{shlex.quote(str(program.parent))}:"$PATH"\n' if is_beside else ""
    return (
        f"{path}pftrack new filter my_filter.py --experiment {next(iter(EXPERIMENTS))}\n"
        "pftrack serve my_filter.py --port 0 --data-dir my_filter_data"
    )


def page(request: Request, name: str, status: int = HTTPStatus.OK, *, content: str = "", about: str = "") -> Response:
    """Return a page with the server's address and links to its scripts' modules.

    Args:
        request: The request.
        name: Name of its file.
        status: Status of the answer.
        content: HTML for its main part.
        about: Attributes of its root element.
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
