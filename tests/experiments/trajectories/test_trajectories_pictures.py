"""Corners of recordings in the experiment `trajectories`: nothing is marked, and much may go wrong."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from pftrack.core.model.drawing import Text
from pftrack.core.model.recipe import Change
from pftrack.experiments import find
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence

EXPERIMENT = find("trajectories")
Picture = NDArray[np.uint8]
CLIPS = Path(__file__).parents[4] / "shared" / "data"


def rectangles(seed: int = 0, size: tuple[int, int] = (240, 180)) -> Picture:
    """A picture of rectangles in many greys."""
    rng = np.random.default_rng(seed)
    grey = np.full(size[::-1], 128, np.uint8)
    for x, y, level in rng.integers(0, [*size, 256], (size[0] * size[1] // 300, 3)).tolist():
        cv2.rectangle(grey, (x, y), (x + 14, y + 9), level, -1)
    return grey


BLANK = np.full((180, 240), 60, np.uint8)


def film(pictures: list[Picture], folder: Path) -> Path:
    for number, grey in enumerate(pictures):
        cv2.imwrite(str(folder / f"{number:03d}.png"), grey)
    return folder


def run_of(path: Path, tracker: str = "lg", *, start: int = 0, frames: int | None = None, **values: Any) -> Run:
    setup = EXPERIMENT.video.on_video(open_sequence(path), None, start=start)
    return Run(EXPERIMENT, setup, tracker=tracker, frames=frames, timeline=(Change(0, values),))


def search_of(run: Run) -> dict[str, Any]:
    drawing = EXPERIMENT.draw(run.current, run.diagnostics)
    return dict(next(each for each in drawing.worlds if each.world.name == "search").primitives)


def report(path: Path, **options: Any) -> dict[str, Any]:
    run = run_of(path, **options)
    run.finish()
    return dict(EXPERIMENT.measured.report(run.diagnostics))  # type: ignore[misc]


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_a_moving_picture_is_followed_with_nothing_marked(tracker: str, tmp_path: Path) -> None:
    """From any picture on corners are found, and their smoothed positions move as the picture does."""
    wide = rectangles(size=(300, 180))
    run = run_of(film([wide[:, 2 * step : 2 * step + 240] for step in range(20)], tmp_path), tracker, start=4)
    state = run.finish().state
    moved = state.raw[0] - state.first
    assert state.raw.shape[1] == 100
    assert np.nanmedian(moved, axis=0).tolist() == [-30.0, 0.0]
    known = np.isfinite(moved[:, 0]) & (state.born == 0)
    assert np.abs(state.filtered[0] - state.raw[0])[known].max() < 2.0


def test_false_motion_is_that_of_what_rests(tmp_path: Path) -> None:
    """Of a picture at rest with something moving in it, only what rests counts, though it is hidden for a while."""
    pictures = [rectangles() for _ in range(40)]
    for step, grey in enumerate(pictures):
        grey[60:100, 4 * step : 4 * step + 30] = rectangles(5)[:40, :30]
    found = report(film(pictures, tmp_path), corner_count=60)
    assert found["tracks"] <= 60
    assert found["false_motion_px"] < 1.0
    wrong = report(tmp_path, corner_count=60, largest_cost=255, new_corners=False)
    assert wrong["false_motion_px"] > 1.3 * found["false_motion_px"]


def test_nothing_is_claimed_of_motion_where_nothing_rests(tmp_path: Path) -> None:
    """With a moving camera there is no corner at rest, and no false motion to be told."""
    wide = rectangles(size=(300, 180))
    found = report(film([wide[:, 3 * step : 3 * step + 200] for step in range(24)], tmp_path))
    assert found["false_motion_px"] is None
    assert found["tracks"] > 20


@pytest.mark.parametrize("size", [(200, 150), (12, 9), (2, 300)])
def test_a_recording_without_corners_is_refused(size: tuple[int, int], tmp_path: Path) -> None:
    """A flat picture, and one that is hardly larger than a template, are refused in a sentence."""
    path = film([np.full(size[::-1], 90, np.uint8)] * 3, tmp_path)
    with pytest.raises(ValueError, match=rf"picture 0, {size[0]} x {size[1]} px, has no corner that can be followed"):
        run_of(path)


def test_parameters_that_leave_no_corner_are_refused(tmp_path: Path) -> None:
    """A margin that leaves no room is told together with what it is."""
    with pytest.raises(ValueError, match="nearer to the edge than 150 px"):
        run_of(film([rectangles()] * 2, tmp_path), corner_margin_px=150).finish()


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_all_matches_may_be_wrong(tracker: str, tmp_path: Path) -> None:
    """From a cut on nothing is found: tracks end, are drawn as far as they are known, and new corners take over."""
    pictures = [rectangles()] * 3 + [BLANK] * 12 + [rectangles(9)] * 18
    run, seen = run_of(film(pictures, tmp_path), tracker, corner_count=20, sample_count=50), []
    for step in run:
        EXPERIMENT.draw(step, run.diagnostics)
        seen.append(np.isfinite(step.state.filtered[0]).all(axis=1).sum())
    assert [seen[frame] for frame in (2, 14, -1)] == [20, 0, 20]
    assert (run.current.state.born >= 20).any()
    assert run.diagnostics[14].number("seen_share") == 0.0


def test_the_search_is_shown_beside_the_picture(tmp_path: Path) -> None:
    """The world has the costs as a surface, the template and what was found; without pictures it says so."""
    run = run_of(film([rectangles()] * 3, tmp_path), search_reach_px=30)
    run.finish()
    world = search_of(run)
    vertices = world["costs"].vertices
    assert len(vertices) == 41**2  # up to 20 px to all sides
    assert vertices[vertices[:, 2].argmax()] == pytest.approx([0.0, 0.0, 7.0])
    assert len(world["looked for"].vertices) == 4 * 11**2
    assert {"window", "template", "look-alikes"} <= EXPERIMENT.draw(run.current, run.diagnostics).primitives.keys()
    table = tmp_path / "path.csv"
    table.write_text("x,y\n1,2\n3,4\n5,6\n")
    assert [type(item) for item in search_of(run_of(table)).values()] == [Text]


@pytest.mark.skipif(not CLIPS.exists(), reason="needs the sample clips in ../shared/data")
def test_the_lattice_does_not_move() -> None:
    """On a printed lattice at rest, which hands hide for a while, false motion is small where bad matches are none."""
    clip = CLIPS / "corners_lattice_static" / "clip.mp4"
    found = report(clip, frames=60, corner_count=60)
    assert found["tracks"] >= 50
    assert found["false_motion_px"] < 3.0
    trusting = report(clip, frames=60, corner_count=60, largest_cost=255, new_corners=False)
    assert trusting["false_motion_px"] > 1.3 * found["false_motion_px"]


@pytest.mark.parametrize("tracker", EXPERIMENT.trackers)
def test_a_corner_that_takes_a_place_at_once_begins_anew(tracker: str, tmp_path: Path) -> None:
    """In the very frame in which a corner is gone another may take over: of the old one nothing is left, in any row."""
    pictures = [rectangles()] * 101 + [BLANK] * 9 + [rectangles(9)]
    state = run_of(film(pictures, tmp_path), tracker, corner_count=20, sample_count=50).finish().state
    again = state.born == 110
    assert again.any()
    assert np.abs(state.filtered[0] - state.raw[0])[again].max() < 8.0
    assert np.isnan(state.history[0][:110, again]).all()
