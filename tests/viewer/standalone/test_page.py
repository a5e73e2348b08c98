"""The page of a run, opened from a file while the network is off."""

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pftrack.core import entry_points
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.model.setup import ExportError
from pftrack.core.model.source import Frame
from pftrack.experiments import find
from pftrack.output.displays import format_reading
from pftrack.runs.run import Run
from tests.conftest import FRUGAL
from tests.making import whole_run
from tests.waiting import wait_for

pytestmark = pytest.mark.browser

FRAMES = 24
CLOUD = """() => {
    let found = null;
    window.__viserMutable?.nodeRefFromName['/particles']?.traverse((item) => {
        if (item.isPoints) found = Array.from(item.geometry.attributes.position.array);
    });
    return found;
}"""


@pytest.fixture(scope="module")
def run() -> Run:
    changes = (Change(0, {"sample_count": 100}), Change(12, {"sample_count": 60}))
    return whole_run(find("ball"), frames=FRAMES, seed=3, timeline=changes)


@pytest.fixture(scope="module")
def opened(run: Run, chromium: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Any, list[str]]]:
    """The page in a browser without a network, and all that it has asked for and complained of."""
    path = tmp_path_factory.mktemp("page") / "run.html"
    run.export(path)
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
    page.wait_for_selector(f'html[data-drawn="{frame}"]', timeout=60_000)


def _cloud(page: Any, count: int) -> np.ndarray:
    """The particles in the scene, (n, 3), in order from left to right."""
    frame = page.frames[1]
    values = wait_for(
        lambda: (found := frame.evaluate(CLOUD)) and len(found) == 3 * count and found,
        what=f"the scene shows {count} particles",
        pause=lambda seconds: page.wait_for_timeout(1e3 * seconds),
    )
    return np.array(values).reshape(-1, 3)


def _particles(run: Run, frame: int) -> np.ndarray:
    """The particles of a frame as the scene has them from the front: y upwards, in order from left to right."""
    drawing = run.experiment.draw(run.seek(frame), run.diagnostics)
    places = drawing.primitives["particles"].positions[:, :2] * (1.0, -1.0)
    return places[np.argsort(places[:, 0], kind="stable")]


def test_scene_plots_and_figures_follow_one_scrubber(run: Run, opened: tuple[Any, list[str]]) -> None:
    """Forwards, backwards and across a change of their number the scene has the particles of the frame that is said."""
    page, heard = opened
    _drawn(page, 0)
    for frame in (20, 5, 13):
        page.fill("#frame", str(frame))
        _drawn(page, frame)
        wanted = _particles(run, frame)
        assert np.abs(_cloud(page, len(wanted))[:, :2] - wanted).max() < 1 / 16
        shown = page.locator("#readings dd").all_text_contents()
        reading = next(each for each in run.experiment.readings if each.kind == "estimate")
        assert format_reading(run.experiment, reading, run.diagnostics[frame]) in shown
        assert page.text_content("#where") == f"frame {frame} / {FRAMES - 1}"
    assert heard == []


def test_keys_and_views_work_and_the_clock_stops_at_the_end(opened: tuple[Any, list[str]]) -> None:
    """Keys work in page and scene alike, a tilted camera raises the particles, and play ends at the last frame."""
    page, heard = opened
    page.locator("h1").click()
    page.keyboard.press("Home")
    page.keyboard.press("Shift+ArrowRight")
    _drawn(page, 10)
    page.frames[1].locator("body").press("ArrowLeft")
    _drawn(page, 9)
    wait_for(
        lambda: np.ptp(_cloud(page, 100)[:, 2]) < 1e-3,
        what="all lie in the picture, as seen from the front",
        pause=lambda seconds: page.wait_for_timeout(1e3 * seconds),
    )
    page.click("[data-view='3-d']")
    wait_for(
        lambda: np.ptp(_cloud(page, 100)[:, 2]) > 5.0,
        what="the particles have risen",
        pause=lambda seconds: page.wait_for_timeout(1e3 * seconds),
    )
    page.select_option("#speed", "4")
    page.click("#play")
    _drawn(page, FRAMES - 1)
    page.wait_for_selector("#play[aria-pressed='false']")
    assert heard == []


def test_the_page_says_what_it_is(run: Run, opened: tuple[Any, list[str]]) -> None:
    """Title, recipe, hash, citation and manifest are in it, to be read without running anything."""
    page, _ = opened
    assert run.experiment.title in page.title()
    assert Recipe.model_validate_json(page.text_content("#recipe")) == run.recipe
    assert run.estimates_sha256 in page.text_content(".about")
    assert run.experiment.references[0].reference.title in page.text_content(".citation")
    assert page.evaluate("JSON.parse(document.getElementById('manifest').textContent).format") == "pftrack-manifest"


def test_nothing_is_wider_than_a_phone(opened: tuple[Any, list[str]]) -> None:
    """At 390 px all is below each other, and nothing has to be moved sideways."""
    page, _ = opened
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert page.locator("#frame").bounding_box()["width"] > 300


def test_a_page_that_is_given_up_leaves_nothing_behind(run: Run, tmp_path: Path) -> None:
    """Stopped between two frames, there is neither a file nor a server, and the run stands where it stood."""
    from pftrack.output.exports.formats import export_at, exporting

    path, before = tmp_path / "run.html", run.position
    steps = exporting(run, path, export_at(run.experiment, path))
    assert [next(steps), next(steps)] == [(1, FRAMES), (2, FRAMES)]
    steps.close()
    assert list(tmp_path.iterdir()) == []
    assert run.position == before


def test_without_a_viewer_a_page_is_refused(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The library alone writes no pages, and says what is missing."""
    found = entry_points.find
    monkeypatch.setattr(entry_points, "find", lambda group, name: None if name == "page" else found(group, name))
    with pytest.raises(ExportError, match="no package is installed that provides 'page'"):
        run.export(tmp_path / "run.html")


class _Noise:
    """A recording at its worst for a page: nothing in a picture is like anything in another."""

    def __init__(self, source: Any) -> None:
        self.frame_count, self.frame_rate_hz, self.start = source.frame_count, source.frame_rate_hz, source.start
        self._source = source

    def frame(self, index: int, history: Any) -> Frame:
        rng = np.random.default_rng(index)
        coarse = rng.integers(0, 255, (48, 64, 3), dtype=np.uint8).repeat(10, 0).repeat(10, 1)
        fine = rng.integers(0, 40, coarse.shape, dtype=np.uint8)
        image_rgb = np.clip(coarse + fine, 0, 255).astype(np.uint8)
        return dataclasses.replace(self._source.frame(index, history), image_rgb=image_rgb)


@pytest.mark.slow
def test_300_frames_of_a_recording_are_under_10_mb(tmp_path: Path) -> None:
    """Pictures of 640 x 480 px with noise in them and 800 particles a frame stay under 10 MB."""
    ball = find("ball")
    setup = ball.simulate()

    def open_noise(seed: int, parameters: Any) -> Any:
        return _Noise(setup.open_source(seed, parameters))

    run = Run(ball, dataclasses.replace(setup, open_source=open_noise), frames=300)
    run.finish()
    run.export(tmp_path / "run.html")
    assert 5e6 < (tmp_path / "run.html").stat().st_size < 10e6
