"""Runs that take long to compute: the page shows how far they are, and a button stops them."""

import re
from pathlib import Path
from typing import Any

import pytest

from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs import record
from pftrack.runs.run import Run
from tests.browser.conftest import Complaints
from tests.browser.host import Server, until
from tests.browser.views import Gallery

HEAVY = {"sample_count": 100_000}
FAR = 24
DROP = """() => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File(["words"], "other.mp4"));
    document.dispatchEvent(new DragEvent("drop", { dataTransfer }));
}"""
WORDS = re.compile(r"Computing frame \d+ of (\d+)")


# An import below shows and stops the same bar; tests/server/sessions/test_reopening.py has the way back.
@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A saved run that takes some seconds to compute."""
    ball = find("ball")
    run = Run(ball, ball.simulate(), tracker="upf", frames=60, timeline=(Change(0, dict(HEAVY)),))
    run.seek(FAR)
    path = tmp_path_factory.mktemp("saved") / "heavy.pft"
    record.save(run, path)
    return path


def test_an_import(gallery: Gallery, server: Server, saved: Path) -> None:
    """A run that is brought in shows how far it is, after a reload too; cancelled, it makes room for another file.

    Until then another file would push it out of sight, and be pushed away by its end.
    """
    page: Any = gallery.page
    drop = page.locator(".drop")
    before = server.get("runs")
    page.set_input_files("#file-picker", str(saved))
    # Asked here, since a fast machine is done before the page asks for the second time.
    until(lambda: any(job["state"] == "working" and job["done"] for job in server.get("jobs")), "it computes")
    with server.freeze_newest():
        page.get_by_text(WORDS).wait_for()
        page.evaluate(DROP)
        page.get_by_text("Other files are still uploading").wait_for()
        assert "heavy.pft" in drop.inner_text()
        page.reload(wait_until="commit")
        page.get_by_text(WORDS).wait_for()
        assert "heavy.pft" in drop.inner_text()
    drop.locator("button").click()
    page.get_by_text("Drop a video here").wait_for()
    assert server.get("runs") == before


def test_an_import_outlasts_a_silence_of_the_server(gallery: Gallery, complaints: Complaints) -> None:
    """While nobody answers the page says so and asks again; what became of the run is told once somebody does."""
    complaints.expected = ("net::ERR_FAILED",)
    page, silent = gallery.page, [True]
    job = {"id": "0123456789abcdef", "name": "heavy.pft", "done": 3, "total": 9, "result": None, "error": None}

    def answer(route: Any) -> None:
        if silent:
            route.abort()
        else:
            route.fulfill(json={**job, "state": "failed", "error": "It went wrong."})

    page.route("**/api/v1/runs/import?*", lambda route: route.fulfill(status=202, json={**job, "state": "working"}))
    page.route("**/api/v1/jobs/*", answer)
    gallery.choose("heavy.pft", b"a run", "application/octet-stream")
    page.get_by_text("The server does not answer; trying again").wait_for()
    silent.clear()
    page.get_by_text("It went wrong.").wait_for()
    assert "heavy.pft was not accepted" in page.inner_text(".drop")
    assert "#" not in page.url
