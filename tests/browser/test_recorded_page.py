"""The page of a run, opened from a file while the network is off."""

import gzip
import json
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeAlias

import cv2
import numpy as np
import pytest

from pftrack.core import entry_points
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.refusal import ConflictError
from pftrack.experiments import find
from pftrack.experiments.shared.sketch import with_depth
from pftrack.runs.run import Run
from pftrack_server.work import page as page_module
from pftrack_server.work.page import shrink, write_page
from tests.browser.accessible import check
from tests.conftest import FRUGAL
from tests.making import whole_run
from tests.server.drawings import decode
from tests.waiting import wait_for

FRAMES = 24
PICTURE = "document.querySelector('.flat-canvas').toDataURL()"
AT = "document.querySelector('.scrubber').getAttribute('aria-valuenow')"
Opened: TypeAlias = tuple[Any, list[str]]
"""A page in a browser without a network, with its requests and complaints."""
HOSTILE = "</script><!--<script><img src=x onerror=document.title='broken'>"


@pytest.fixture(scope="module")
def run() -> Run:
    changes = (Change(0, {"sample_count": 100}), Change(12, {"sample_count": 60}))
    return whole_run(find("ball"), frames=FRAMES, seed=3, timeline=changes)


def _open(chromium: Any, path: Path) -> Iterator[Opened]:
    context = chromium.new_context(offline=True, viewport={"width": 1280, "height": 800})
    context.add_init_script(FRUGAL)
    page, heard = context.new_page(), []
    page.on("pageerror", lambda error: heard.append(str(error)))
    page.on("request", lambda request: request.url.startswith(("file:", "data:", "blob:")) or heard.append(request.url))
    page.on("console", lambda message: message.type == "error" and heard.append(message.text))
    page.goto(path.as_uri())
    yield page, heard
    context.close()


def _drawn(page: Any, frame: int) -> None:
    page.wait_for_selector(f'.flat-canvas[data-frame="{frame}"]', timeout=60_000)


def _wait(page: Any, condition: str) -> None:
    """Wait without evaluating text in the page, which its policy forbids."""
    wait_for(lambda: page.evaluate(condition), what=condition[:80], pause=lambda s: page.wait_for_timeout(1e3 * s))


def test_the_page_shows_the_run_without_a_network(run: Run, chromium: Any, tmp_path: Path) -> None:
    """Picture, readings and counter follow scrubber, keys and play; layers can be hidden; the page describes itself.

    Title, recipe, hash, citation and manifest can be read without a script, axe finds nothing, and it fits a phone.
    """
    run.export(tmp_path / "run.html")
    for page, heard in _open(chromium, tmp_path / "run.html"):
        _drawn(page, 0)
        # Forwards, backwards and across a change the page shows one frame's picture, readings and place.
        scrubber = page.locator(".scrubber")
        box = scrubber.bounding_box()
        pictures = set()
        for share in (0.9, 0.3):
            before = scrubber.get_attribute("aria-valuenow")
            page.mouse.click(box["x"] + share * box["width"], box["y"] + box["height"] / 2)
            _wait(page, f"{AT} !== {before!r} && {AT} === document.querySelector('.flat-canvas').dataset.frame")
            frame = int(scrubber.get_attribute("aria-valuenow"))
            assert page.text_content(".counter") == f"frame {frame} / {FRAMES}"
            shown = page.locator(".readout dd").all_text_contents()
            assert f"{', '.join(f'{value:.1f}' for value in run.diagnostics[frame].estimate)} px" in shown
            pictures.add(page.evaluate(PICTURE))
        assert len(pictures) == 2
        assert page.locator(".plots .figure-panel canvas").count() > 0
        # Without a layer the picture is painted anew, and its colours leave the legend.
        before = page.evaluate(PICTURE)
        page.get_by_text("What to draw").click()
        page.get_by_label("Truth", exact=True).uncheck()
        _wait(page, f"{PICTURE} !== {before!r}")
        assert "truth" not in page.locator(".legend li").all_text_contents()
        page.get_by_label("Truth", exact=True).check()
        _wait(page, f"{PICTURE} === {before!r}")
        for key, frame in (("Home", 0), ("Shift+ArrowRight", 10), ("ArrowLeft", 9)):
            page.keyboard.press(key)
            _drawn(page, frame)
        page.select_option(".transport select", "5")
        page.keyboard.press("Space")
        _drawn(page, FRAMES - 1)
        page.wait_for_selector(".play[title^='Play again']")

        assert run.experiment.title in page.title()
        assert Recipe.model_validate_json(page.text_content("#recipe")) == run.recipe
        assert run.estimates_sha256 in page.text_content(".about")
        assert run.experiment.texts.references[0].reference.title in page.text_content(".citation")
        assert page.evaluate("JSON.parse(document.getElementById('manifest').textContent).format") == "pftrack-manifest"
        check(page)
        page.set_viewport_size({"width": 390, "height": 844})
        _wait(page, "document.documentElement.scrollWidth <= 390")
        assert page.locator(".scrubber").bounding_box()["width"] > 300
        assert heard == []


def test_no_text_becomes_a_script_or_markup(chromium: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The page shows names of clips and texts of filters as they are, from any author; its world can be turned."""
    run = whole_run(find("head"), frames=3)
    described = page_module.describe(run).model_copy(update={"title": HOSTILE, "target": HOSTILE, "subject": HOSTILE})
    monkeypatch.setattr(page_module, "describe", lambda _: described)
    for name in ("title_of", "citation_of"):
        monkeypatch.setattr(page_module, name, lambda _: HOSTILE)
    monkeypatch.setattr(page_module, "manifest_of", lambda _: {"title": HOSTILE})
    monkeypatch.setattr(page_module, "summary_lines", lambda _: {HOSTILE: HOSTILE})
    list(write_page(run, tmp_path / "run.html"))
    for page, heard in _open(chromium, tmp_path / "run.html"):
        _drawn(page, 0)
        assert page.title() == HOSTILE
        assert page.text_content(".citation") == HOSTILE
        assert page.locator("img").count() == 0
        assert page.evaluate("JSON.parse(document.getElementById('manifest').textContent).title") == HOSTILE
        page.click(".world-sides button[data-viewpoint]:last-child")
        page.wait_for_selector(".world-sides button:last-child[aria-pressed='true']")
        assert page.locator(".world-canvas").get_attribute("data-elevation") == "90"
        assert heard == []


def _drawings(run: Run, most_bytes: int) -> page_module.Drawings:
    steps = page_module.draw(run, most_bytes)
    for _ in range(FRAMES):
        next(steps)
    with pytest.raises(StopIteration) as done:
        next(steps)
    return done.value.value


def test_the_drawings_are_those_of_the_stream(run: Run) -> None:
    """Each has the particles of its frame to 14 binary digits and its pictures; less room leaves fewer drawings."""
    drawings = _drawings(run, 1_000_000)
    data = gzip.decompress(drawings.packed)
    for frame, parts in enumerate(drawings.parts):
        told, drawing, _ = decode(b"".join(data[first:end] for first, end in parts))
        wanted = with_depth(run.experiment.draw(run.seek(frame), run.diagnostics), run.experiment.display.layers)
        assert told == frame
        assert drawing.primitives.keys() == wanted.primitives.keys()
        assert [each.world.name for each in drawing.worlds] == ["in depth"]
        read, known = (each.primitives["particles"].positions for each in (drawing, wanted))
        np.testing.assert_allclose(read, known, rtol=2.0**-14)
    fewer = _drawings(run, 20_000)
    assert (fewer.every > 1, len(fewer.packed) < 20_000) == (True, True)
    assert len(fewer.parts) == -(-FRAMES // fewer.every)


def test_a_large_cloud_and_a_long_run_are_thinned(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only some of many points and frames are drawn; the numbers are complete."""
    monkeypatch.setattr(page_module, "MOST_POINTS", 40)
    monkeypatch.setattr(page_module, "MOST_FRAMES", 12)
    list(write_page(run, tmp_path / "run.html"))
    text = (tmp_path / "run.html").read_text()
    assert all(f"One of {said} drawn" in text for said in ("2 frames is", "3 points of each large cloud is"))
    recording, hello, drawings = (
        text.partition(f'id="{name}">')[2].partition("</script>")[0] for name in ("recording", "hello", "drawings")
    )
    assert (len(json.loads(recording)["parts"]), len(json.loads(hello)["diagnostics"]["frame"])) == (12, FRAMES)
    assert gzip.decompress(b64decode(drawings))[:3] == b"pfd"


def test_without_the_server_a_page_is_refused(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library alone cannot write pages, and names the missing part."""
    found = entry_points.find
    monkeypatch.setattr(entry_points, "find", lambda group, name: None if name == "page" else found(group, name))
    with pytest.raises(ConflictError, match="no package is installed that provides 'page'"):
        run.export(tmp_path / "run.html")


def test_pictures_that_are_too_large_are_made_coarser_until_they_fit() -> None:
    """All pictures of a page together fit their limit; those that fit stay as they are; others must be JPEG files."""
    noise = np.random.default_rng(0).integers(0, 255, (6, 240, 320, 3), dtype=np.uint8)
    files = [cv2.imencode(".jpg", each, (cv2.IMWRITE_JPEG_QUALITY, 88))[1].tobytes() for each in noise]
    whole = sum(map(len, files))
    assert shrink(files, whole) == files
    assert sum(map(len, shrink(files, whole // 3))) <= whole // 3
    assert sum(map(len, shrink(files, 1))) < whole // 3, "what cannot fit is as small as it gets"
    assert shrink([], 0) == []
    with pytest.raises(ValueError, match="not a JPEG"):
        shrink([b"no picture"], 1)
