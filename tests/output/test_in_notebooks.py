"""Displays where they are shown: in notebooks, whose style sheets have rules of their own for pictures and tables."""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import nbformat
import pytest

import pftrack
from tests.conftest import CHROMIUM
from tests.output.notebook_styles import STYLES, faults
from tests.waiting import wait_for

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(not CHROMIUM.exists(), reason="needs Debian's chromium at /usr/bin/chromium"),
]
LAB = shutil.which("jupyter-lab")
TRUST = shutil.which("jupyter-trust")
CONTRAST = """(cell) => {
    const light = (it, what) => {
        const [red, green, blue, alpha = 1] = getComputedStyle(it)[what].match(/[\\d.]+/g).map(Number);
        return alpha === 0 ? light(it.parentElement, what) : (red + green + blue) / 765;
    };
    return Math.abs(light(cell, 'color') - light(cell, 'backgroundColor'));
}"""
"""How far the letters of a cell of a table are from what they stand on, from 0 to 1."""


@pytest.fixture(scope="module")
def displays() -> list[str]:
    run = pftrack.run("ball", frames=60, seed=3, occlusion_width_px=70.0)
    other = pftrack.run("ball", tracker="condensation", frames=60, seed=3, occlusion_width_px=70.0)
    return [run._repr_html_(), pftrack.compare(run, other)._repr_html_()]


@pytest.mark.parametrize("style", STYLES)
def test_nothing_is_cut_or_covered(chromium: Any, displays: list[str], style: str) -> None:
    """Pictures and curves stay in their places under the rules of each notebook, in wide and in narrow cells."""
    outputs = "".join(f'<div class="output"><div>{display}</div></div>' for display in displays)
    page = chromium.new_page()
    try:
        page.set_content(f"<style>{STYLES[style]}</style>{outputs}")
        for width in (1200, 900, 700):
            page.set_viewport_size({"width": width, "height": 900})
            assert faults(page) == [], f"at {width} px"
    finally:
        page.close()


@pytest.mark.slow
@pytest.mark.skipif(LAB is None or TRUST is None, reason="needs JupyterLab 4 on the path, in whatever environment")
@pytest.mark.parametrize("theme", ["JupyterLab Light", "JupyterLab Dark"])
def test_jupyterlab_shows_them_whole(chromium: Any, displays: list[str], theme: str, tmp_path: Path) -> None:
    """A notebook with both outputs, opened in JupyterLab itself: nothing is cut or covered, and letters can be read."""
    book = nbformat.v4.new_notebook()
    for display in displays:
        output = nbformat.v4.new_output("display_data", {"text/html": display})
        book.cells.append(nbformat.v4.new_code_cell("run", outputs=[output]))
    nbformat.write(book, tmp_path / "shown.ipynb")
    with jupyterlab(tmp_path, theme) as address:
        page = chromium.new_page(viewport={"width": 1280, "height": 1600})
        try:
            page.goto(f"{address}/lab/tree/shown.ipynb")
            page.locator(".jp-OutputArea .pftrack").nth(1).wait_for()
            page.locator(f"body[data-jp-theme-name='{theme}']").wait_for(state="attached")
            assert faults(page) == []
            assert page.locator(".pftrack td").last.evaluate(CONTRAST) > 0.5
        finally:
            page.close()


@contextmanager
def jupyterlab(folder: Path, theme: str) -> Iterator[str]:
    """Serve a folder's notebooks, all of them trusted, in a theme."""
    assert LAB is not None
    assert TRUST is not None
    settings = folder / "settings" / "@jupyterlab" / "apputils-extension" / "themes.jupyterlab-settings"
    settings.parent.mkdir(parents=True)
    settings.write_text(json.dumps({"theme": theme}))
    own = {f"JUPYTER_{name}_DIR": str(folder / name.lower()) for name in ("CONFIG", "DATA", "RUNTIME")}
    environment = {**os.environ, **own, "JUPYTERLAB_SETTINGS_DIR": str(folder / "settings")}
    environment.pop("PYTHONPATH", None)
    subprocess.run([TRUST, *map(str, folder.glob("*.ipynb"))], env=environment, check=True)
    options = ["--no-browser", "--allow-root", "--port=0", "--IdentityProvider.token="]
    with subprocess.Popen([LAB, *options], env=environment, stderr=subprocess.DEVNULL, cwd=folder) as server:
        try:
            told = wait_for(lambda: next((folder / "runtime").glob("jpserver-*.json"), None), 60, "it has started")
            yield json.loads(told.read_text())["url"].rstrip("/")
        finally:
            server.kill()  # asked to end while a page is open, it may take minutes
