"""The trackers by colour histograms, the lawn that they are tried on, and recordings."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.marks import Box
from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame, History, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.histogram.experiment import TRACKERS, look_beside
from pftrack.experiments.histogram.look import first_cells, first_look, model_of
from pftrack.experiments.histogram.model import MODEL, SIZE, judge
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.experiments.histogram.scene import LawnSceneParameters, LawnSource, visible_share
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.sources.truth import TruthTable
from pftrack.vision.likelihoods.histogram import Window, fit, similarity
from tests.experiments.head.heads import Pictures
from tests.making import whole_run

HISTOGRAM = find("histogram")
TRACKER = TRACKERS["condensation"]
EMPTY = Frame(1, 0.0, image_rgb=np.full((80, 120, 3), (40, 160, 60), np.uint8))


def run_of(tracker: str, frames: int, seed: int = 0, /, **values: Any) -> Run:
    timeline = (Change(0, values),) if values else ()
    return Run(HISTOGRAM, HISTOGRAM.simulate(), tracker=tracker, seed=seed, frames=frames, timeline=timeline)


def patch(column: int, row: int) -> Frame:
    """A red and yellow square on green."""
    image = np.full((80, 120, 3), (40, 160, 60), np.uint8)
    image[max(row - 8, 0) : row, max(column - 8, 0) : column + 9] = (200, 40, 40)
    image[max(row, 0) : row + 9, max(column - 8, 0) : column + 9] = (210, 190, 40)
    return Frame(0, 0.0, image_rgb=image)


SMALL = revise(HistogramTrackerParameters(), {"window_width_px": 17, "window_height_px": 17, "sample_count": 200})


def stepped(state: Any, frame: Frame, parameters: HistogramTrackerParameters, index: int = 1) -> Any:
    return TRACKER.step(state, frame, parameters, Stream(1, index, Purpose.TRACK))


def begun(parameters: HistogramTrackerParameters = SMALL, tracker: str = "condensation") -> Any:
    target = Target(np.array([40.0, 40.0]), 17.0)
    return TRACKERS[tracker].start(target, patch(40, 40), parameters, Stream(1, 0, Purpose.START))


def test_target_look_alike_and_lawn_are_as_like_as_the_lesson_says() -> None:
    """In frame 30 of scene 0: rho .99 +- .01, .960 +- .03 and .40 +- .08."""
    run = run_of("greedy", 31)
    first, later = run.seek(0), run.seek(30)
    window = Window(12, 16)
    model = fit(first.frame.image_rgb, first.frame.target.position, window, "hsv")
    look_alike = np.array([250 - 2.4 * 30, 138 - 6 * np.sin(2 * np.pi * 30 / 70)])
    places = [later.frame.target.position, look_alike, np.array([60.0, 60.0]), np.array([250.0, 200.0])]
    rho = [similarity(later.frame.image_rgb, place, window, "hsv", model) for place in places]
    assert rho[0] == pytest.approx(0.99, abs=0.01)
    assert rho[1] == pytest.approx(0.96, abs=0.03)
    assert rho[2:] == pytest.approx([0.40, 0.40], abs=0.08)


@pytest.mark.parametrize("values", [{}, {"velocity_retention": 0.5}])
def test_particles_move_by_the_equations(values: dict[str, float]) -> None:
    """X' = x + r v + s_p n and v' = r v + s_v n of the parents; without noise nothing else."""
    still = revise(SMALL, {"process_noise_px": 0.01, "velocity_noise_px": 0, "initial_velocity_px": 3, **values})
    state = begun(still)
    after = stepped(state, patch(40, 40), still)
    parents = state.particles.states[after.particles.ancestors]
    kept = still.velocity_retention * parents[:, 2:4]
    assert np.allclose(after.particles.states[:, 2:4], kept, rtol=0, atol=1e-12)
    assert np.allclose(after.particles.states[:, :2], parents[:, :2] + kept, rtol=0, atol=0.06)


def test_weights_are_the_likelihood() -> None:
    """After resampling the log weights are -lambda (1 - rho) up to a constant, and frame 0 is weighed as well."""
    state = begun()
    for frame, old in ((patch(40, 40), state), (patch(43, 41), None)):
        new = old or stepped(state, frame, SMALL)
        scores = MODEL.log_likelihood(new.particles.states, frame, SMALL, new)
        off = new.particles.log_weights - scores
        assert np.ptp(off) < 1e-9
        rho = similarity(frame.image_rgb, new.particles.states[5, :2], new.first_window, "hsv", new.model)
        assert scores[5] == pytest.approx(-20 * (1 - rho))


def test_greedy_search_finds_the_exact_place_within_reach() -> None:
    """It goes to the very pixel within its reach, and no further."""
    greedy = TRACKERS["greedy"]
    state = greedy.step(begun(tracker="greedy"), patch(47, 36), SMALL, Stream(1, 1, Purpose.TRACK))
    assert state.estimate.tolist() == [47.0, 36.0]
    state = greedy.step(begun(tracker="greedy"), patch(55, 40), SMALL, Stream(1, 1, Purpose.TRACK))
    assert abs(state.estimate[0] - 40) <= 8


@pytest.mark.parametrize("scale", [1.5, 0.7])
def test_the_size_is_followed(scale: float) -> None:
    """A target that grows or shrinks little by little takes its window along; switched off, the size stays."""
    parameters = revise(SMALL, {"follow_size": True, "sample_count": 500, "sharpness": 60})
    off = abs(np.mgrid[:80, :120] - 40).max(axis=0)

    def framed(size: float) -> Frame:
        """A yellow square in a red frame: a part of it has other shares than all of it."""
        image = np.full((80, 120, 3), (40, 160, 60), np.uint8)
        image[off < 8.5 * size], image[off < 5.5 * size] = (200, 40, 40), (210, 190, 40)
        return Frame(0, 0.0, image_rgb=image)

    target = Target(np.array([40.0, 40.0]), 17.0)
    state = TRACKER.start(target, framed(1.0), parameters, Stream(1, 0, Purpose.START))
    for index in range(1, 31):
        frame = framed(1 + (scale - 1) * index / 30)
        state = stepped(state, frame, parameters, index)
    assert state.box_px[0] / 17 == pytest.approx(scale, rel=0.15)
    after = stepped(state, frame, revise(parameters, {"follow_size": False}), 31)
    kept = state.particles.states[after.particles.ancestors, SIZE]
    assert np.array_equal(after.particles.states[:, SIZE], kept)


def test_another_space_is_counted_from_the_first_look() -> None:
    """Choosing another space or kernel in mid-run gives the model that a run begun with it has."""
    state = begun()
    for values in ({"colour_space": "lab"}, {"spatial_kernel": True}, {"colour_space": "chromaticity"}):
        parameters = revise(SMALL, values)
        assert np.array_equal(stepped(state, patch(40, 40), parameters).model, begun(parameters).model)


def test_what_is_lost_is_searched_and_found() -> None:
    """After some frames without it the tracker says that it searches, spreads, and begins again where the target is."""
    parameters = revise(SMALL, {"search_share": 1.0, "lost_after_frames": 3})
    state, searching = begun(parameters), []
    for index in range(1, 7):
        state = stepped(state, EMPTY, parameters, index)
        searching.append(TRACKER.searching(state))
    assert searching == [False, False, True, True, True, True]
    assert state.sigma.min() > 15
    state = stepped(state, patch(95, 25), parameters, 7)
    assert not TRACKER.searching(state)
    assert np.hypot(*(state.estimate - [95, 25])) < 4
    for index in range(8, 12):
        state = stepped(state, patch(95, 25), parameters, index)
    assert np.hypot(*(state.estimate - [95, 25])) < 2
    given_up = revise(parameters, {"search_share": 0.0})
    never = TRACKER.searching(stepped(state, EMPTY, given_up, 12))
    assert never is None, "one that never looks for its target does not say that it follows"


def test_a_target_outside_the_picture_is_refused() -> None:
    """A start with too little of the window within the picture is refused with the reason."""
    target = Target(np.array([-30.0, 40.0]), 17.0)
    with pytest.raises(ValueError, match="a quarter of the target's window"):
        TRACKER.start(target, patch(40, 40), SMALL, Stream(1, 0, Purpose.START))


def test_a_target_at_the_edge_is_seen_as_in_the_picture() -> None:
    """The model of a clipped first look is that of the window in the whole picture."""
    image = patch(40, 40).image_rgb
    image[36:40, 0:3] = (10, 20, 230)
    image[30:50, 3:6] = (230, 20, 230)
    for kernel in (False, True):
        place = np.array([-3.0, 40.0])
        expected = fit(image, place, Window(8, 8, kernel), "hsv")
        assert np.array_equal(model_of(first_look(image, place, SMALL), "hsv", kernel, (1, 1)), expected)


def test_misses_count_only_in_a_row() -> None:
    """A frame that shows the target again clears the misses; while it is searched, the likeness of finding decides."""
    image = patch(40, 40).image_rgb
    state = replace(begun(), missed=5)
    assert judge(state, image, SMALL).missed == 0
    assert judge(state, np.full_like(image, 90), SMALL).missed == 6
    image[40:49, 32:49] = (200, 40, 40)
    for searching, found, missed in ((False, 0.95, 0), (True, 0.95, 6), (True, 0.5, 0)):
        parameters = revise(SMALL, {"lost_likeness": 0.3, "found_likeness": found})
        assert judge(replace(state, searching=searching), image, parameters).missed == missed


def test_the_model_is_renewed_by_its_share_where_it_is_sure() -> None:
    """The new model is (1 - r) q + r p; it stays where the target is hidden or the cloud is wide."""
    image, state, old = patch(40, 40).image_rgb, begun(), np.full(110, 1 / 110)
    values = {"renewal_rate": 0.2, "renewal_likeness": 0, "renewal_spread": 10}
    renewing, whole = (revise(SMALL, {**values, "renewal_rate": rate}) for rate in (0.2, 1))
    seen = judge(replace(state, model=old), image, whole).model
    assert judge(replace(state, model=old), image, renewing).model == pytest.approx(0.8 * old + 0.2 * seen)
    assert judge(state, EMPTY.image_rgb, revise(renewing, {"renewal_likeness": 0.5})).model is state.model
    assert judge(state, image, revise(renewing, {"renewal_spread": 0})).model is state.model


def test_what_is_found_is_found_without_an_offset() -> None:
    """The cloud that begins again lies around the place in the picture, and not half a step beside it."""
    big = revise(HistogramTrackerParameters(), {"window_width_px": 61, "window_height_px": 61, "search_share": 1.0})
    image = np.full((240, 320, 3), (40, 160, 60), np.uint8)
    image[90:151, 100:161] = (200, 40, 40)
    target = Target(np.array([130.0, 120.0]), 61.0)
    state = TRACKER.start(target, Frame(0, 0.0, image_rgb=image), big, Stream(1, 0, Purpose.START))
    # Cells of 10 px have their middles at 5, 15, ...
    moved = np.roll(image, (5, 5), (0, 1))
    after = stepped(replace(state, searching=True), Frame(1, 0.1, image_rgb=moved), big)
    assert not after.searching
    assert np.hypot(*(after.estimate - [135, 125])) < 2


@pytest.mark.parametrize(
    "values", [{"renewal_rate": 0.1}, {"search_share": 1.0}, {"follow_size": True}, {"follow_camera": True}]
)
def test_what_is_decided_between_frames_is_not_folded(values: dict[str, Any]) -> None:
    """Renewal, search, size and camera take frames one by one, in batches as in live runs."""
    parameters, pictures = revise(SMALL, values), np.stack([patch(40, 40).image_rgb] * 2)
    assert TRACKER.fold is not None
    assert TRACKER.fold(begun(parameters), pictures, parameters, 1, 1) is None


def test_velocities_that_nothing_is_added_to_die_out() -> None:
    """Without noise on the velocity resampling leaves ever fewer different ones; with some, all stay different."""
    still, noisy = (
        [row.diagnostics.number("velocities") for row in run_of("condensation", 25, velocity_noise_px=noise)]
        for noise in (0.0, 0.3)
    )
    assert noisy == [still[0]] * 25 == [300.0] * 25
    assert still == sorted(still, reverse=True)
    assert still[-1] < 30


def test_a_model_is_its_first_look_until_it_is_renewed() -> None:
    """The likeness of model and first look is 1 without renewal, and the overlap of both histograms with it."""
    run = run_of("condensation", 6)
    assert [row.diagnostics.number("first_likeness") for row in run] == pytest.approx([1.0] * 6, abs=1e-12)
    renewed = run_of("condensation", 6, renewal_rate=0.5)
    first = renewed.current.state.model
    renewed.finish()
    expected = np.sqrt(first * renewed.current.state.model).sum()
    assert renewed.diagnostics[-1].number("first_likeness") == pytest.approx(expected, abs=1e-12)
    assert expected < 0.999


def test_some_particles_move_further() -> None:
    """One in five gets the wide noise, the others the usual one; while all noise is large there is no such share."""
    wide = revise(SMALL, {"process_noise_px": 0.5, "velocity_noise_px": 0, "wide_share": 0.2, "wide_noise_px": 50})
    state = begun(wide)
    after = stepped(state, patch(40, 40), wide)
    parents = state.particles.states[after.particles.ancestors]
    off = np.abs(after.particles.states[:, :2] - parents[:, :2] - parents[:, 2:4])
    assert off[::5].max() > 20
    assert np.delete(off, np.s_[::5], axis=0).max() < 3


def test_the_camera_is_followed() -> None:
    """A picture that jumps by 20 px takes the cloud along; without that, the cloud is left behind."""
    rng = np.random.default_rng(0)
    ground = np.repeat(np.repeat(rng.integers(40, 90, (30, 40, 1), np.uint8), 8, axis=0), 8, axis=1)
    world = np.repeat(ground, 3, axis=2)
    world[110:127, 140:157] = (230, 30, 30)
    off = {}
    for follow in (False, True):
        parameters = revise(SMALL, {"follow_camera": follow, "process_noise_px": 0.5, "velocity_noise_px": 0})
        first = np.ascontiguousarray(world[60:180, 80:240])
        later = np.ascontiguousarray(world[50:170, 60:220])
        for tracker in ("condensation", "greedy"):
            chosen, (one, other) = TRACKERS[tracker], (Frame(0, 0.0, image_rgb=it) for it in (first, later))
            target = Target(np.array([68.0, 58.0]), 17.0)
            state = chosen.start(target, one, parameters, Stream(1, 0, Purpose.START))
            state = chosen.step(state, other, parameters, Stream(1, 1, Purpose.TRACK))
            off[tracker, follow] = float(np.hypot(*(state.estimate - (88.0, 68.0))))
    assert max(off["condensation", True], off["greedy", True]) < 3
    assert min(off["condensation", False], off["greedy", False]) > 10


def test_ways_of_counting_may_change_in_mid_run() -> None:
    """Parts, weights and contrast take effect in the next frame, and back again."""
    state, plain = begun(), begun()
    parts = revise(SMALL, {"parts_across": 2, "parts_down": 3, "weigh_background": True, "surround_contrast": 0.2})
    state = stepped(state, patch(40, 40), parts)
    assert state.parts == (2, 3)
    assert len(state.model) == 6 * len(plain.model)
    assert np.allclose(state.whole_model, plain.model)
    assert state.background.contrast == 0.2
    state = stepped(state, patch(40, 40), SMALL, 2)
    assert np.array_equal(state.model, plain.model)
    assert state.background_use == (False, 0.0)


STILL = {"image_noise_sd": 0, "lighting_amplitude": 0}


def frame(index: int, values: dict[str, Any] | None = None) -> Any:
    parameters = revise(LawnSceneParameters(), values or {})
    return LawnSource(0, parameters).frame(index, History(((0, parameters),)))


def test_the_target_is_hidden_when_the_reference_scene_hides_it() -> None:
    """It is partly hidden in frames 76 to 107 and wholly in frames 87 to 96."""
    shares = np.array([visible_share(index, LawnSceneParameters()) for index in range(120)])
    partly, wholly = np.flatnonzero(shares < 1), np.flatnonzero(shares == 0)
    assert (partly[0], partly[-1], wholly[0], wholly[-1]) == (76, 107, 87, 96)
    assert [frame(index).target.hidden for index in (86, 87, 96, 97)] == [False, True, True, False]


def test_path_colours_and_column() -> None:
    """The target begins at (28, 120), red above, yellow below; the column covers x = 206 to 251, darker at its ends."""
    first = frame(0, STILL)
    assert first.target.position.tolist() == [28.0, 120.0]
    assert first.target.extent == (25.0, 33.0)
    assert first.image_rgb[110, 28].tolist() == [205, 40, 40]
    assert first.image_rgb[130, 28].tolist() == [215, 190, 40]
    bare = frame(0, {**STILL, "occlusion_width_px": 0}).image_rgb
    covered = np.flatnonzero((first.image_rgb != bare).any(axis=(0, 2)))
    assert (covered[0], covered[-1]) == (206, 251)
    assert (first.image_rgb[:, [206, 207, 250, 251]].max(axis=(0, 2)) < 80).all()
    later = frame(30, STILL)
    assert later.target.position == pytest.approx([94.0, 120.0 + 14.0 * np.sin(2 * np.pi / 3)])


def test_the_target_passes_in_front_of_the_look_alike() -> None:
    """Where both are, in frame 47, the picture does not depend on the look-alike under the target."""
    shown = [frame(47, {**STILL, "look_alike_red": share}) for share in (0.0, 1.0)]
    column, row = shown[0].target.position.astype(int)
    window = np.s_[row - 8 : row + 9, column - 6 : column + 7]
    assert np.array_equal(shown[0].image_rgb[window], shown[1].image_rgb[window])
    assert not np.array_equal(shown[0].image_rgb, shown[1].image_rgb)


def test_each_scene_has_its_number() -> None:
    """Other numbers give other lawns; the column is grey where that is asked."""
    assert not np.array_equal(frame(5).image_rgb, frame(5, {"scene_number": 1}).image_rgb)
    grey = frame(5, {**STILL, "column_colours": "grey"}).image_rgb[:, 210:248].astype(int)
    assert np.ptp(grey, axis=2).max() == 0
    assert grey.std() > 1


def test_noise_and_light() -> None:
    """Pixel noise has the standard deviation that is asked for, and the light grows by its amplitude."""
    still, noisy = frame(0, STILL), frame(0, {**STILL, "image_noise_sd": 10})
    assert (noisy.image_rgb.astype(float) - still.image_rgb).std() == pytest.approx(10, rel=0.02)
    dark, light = (frame(index, {**STILL, "lighting_amplitude": 0.5}).image_rgb for index in (37, 12))
    assert light[:60].mean() / dark[:60].mean() == pytest.approx(3.0, rel=0.05)


def test_it_goes_on_for_ever() -> None:
    """Long after the target has left the picture there is still a frame, in which it is not hidden but away."""
    assert frame(5000).image_rgb.shape == (240, 320, 3)
    assert frame(5000).target.hidden is False
    assert frame(1).target.hidden is False  # a flag of Python, as messages have it


# Recordings.


RED, WHITE = (200, 50, 50), (240, 240, 240)


def film(colour: tuple[int, int, int] = RED) -> Pictures:
    """A square that walks to the right over grey."""
    shown = np.full((12, 60, 90, 3), 110, np.uint8)
    for index, picture in enumerate(shown):
        picture[20:35, 10 + 3 * index : 25 + 3 * index] = colour
    return Pictures(list(shown))


@pytest.mark.parametrize(("tracker", "colour"), [("condensation", WHITE), *((it, RED) for it in HISTOGRAM.trackers)])
def test_a_film_is_followed(tracker: str, colour: tuple[int, int, int]) -> None:
    """Every tracker is on the square to the end, and its boxes overlap the true ones; white is told by brightness."""
    truth = TruthTable({index: (10.0 + 3 * index, 20.0, 15.0, 15.0) for index in range(12)})
    setup = HISTOGRAM.video.on_video(film(colour), Box.of(10, 20, 15, 15), truth=truth)
    measures = whole_run(HISTOGRAM, setup, tracker=tracker, seed=1).summary().measures
    assert measures["mean_iou"] > 0.7
    assert measures["held_at_end"] == 1.0


@pytest.mark.parametrize("box", [Box.of(17, 27, 1, 1), Box.of(0, 0, 90, 60), Box.of(88, 0, 2, 60)])
def test_tiny_and_huge_boxes_run(box: Box) -> None:
    """A box of one pixel, of the whole picture and at its edge give finite estimates."""
    run = whole_run(HISTOGRAM, HISTOGRAM.video.on_video(film(), box), seed=1)
    assert all(np.isfinite(row.estimate).all() for row in run.diagnostics)


def textured(grey: bool) -> Pictures:
    """A square of upright stripes that walks over lying ones; in colour it is red besides."""
    rows, columns = np.mgrid[:120, :200]
    shown = []
    for index in range(20):
        left = 30 + 5 * index
        inside = (abs(columns - left - 12) <= 12) & (abs(rows - 60) <= 12)
        bright = 70 + 100 * np.where(inside, (columns - left) // 4 % 2, rows // 4 % 2)
        picture = np.repeat(bright[..., None], 3, axis=2).astype(np.uint8)
        picture[inside & (not grey), 1:] = 30
        shown.append(picture)
    return Pictures(shown)


@pytest.mark.parametrize("place", [(-500.0, 100.0), (2000.0, 100.0), (100.0, -900.0)])
def test_nothing_is_beside_an_estimate_that_has_left_the_picture(place: tuple[float, float]) -> None:
    """Otherwise a log would be full of a measurement that fails."""
    step = run_of("condensation", 2).advance()
    assert look_beside(step.frame, step.state, step.parameters) < 0.1
    assert np.isnan(look_beside(step.frame, MODEL.moved(step.state, None, np.array(place)), step.parameters))


def test_a_grey_target_is_followed_by_its_edges() -> None:
    """Where all places have the same histogram, a recording is followed by its cells, and worse without them."""
    grey, mark = textured(grey=True), Box.of(30, 48, 25, 25)
    truth = TruthTable({index: (30.0 + 5 * index, 48.0, 25.0, 25.0) for index in range(20)})
    setup = HISTOGRAM.video.on_video(grey, mark, truth=truth)
    coloured = HISTOGRAM.video.on_video(textured(grey=False), mark).parameters.cells_share
    assert setup.parameters.cells_share > 0.9
    assert 0.4 <= coloured <= 0.6, "colours that separate it as well count as much"
    overlaps = {}
    for values in ({}, {"cells_share": 0.0}):
        ((found,),) = outcomes(HISTOGRAM, setup, values=values, trackers=["condensation"], seeds=[1], frames=20)
        overlaps[bool(values)] = found.measures["mean_iou"]
    assert overlaps[False] > 0.8
    assert overlaps[True] < overlaps[False] - 0.1
    run = whole_run(HISTOGRAM, setup, tracker="condensation", seed=1, frames=20)
    state, seen = run.current.state, (run.current.frame.picture, run.current.parameters)
    assert judge(state, *seen).missed == 0
    assert judge(replace(state, usual=2.5 * state.usual), *seen).missed == 1, "half of the usual score is too low"


def test_a_target_that_comes_back_elsewhere_is_found() -> None:
    """While the target is lost some or all particles look all over the picture; without them it stays lost."""
    shown, truth = np.full((24, 120, 200, 3), 110, np.uint8), {}
    for index, picture in enumerate(shown):
        if not 8 <= index < 12:
            x, y = (20 + 2 * index, 30) if index < 8 else (160, 80)
            picture[y : y + 15, x : x + 15] = RED
            truth[index] = (float(x), float(y), 15.0, 15.0)
    setup = HISTOGRAM.video.on_video(Pictures(list(shown)), Box.of(20, 30, 15, 15), truth=TruthTable(truth))
    for share, found in ((0.1, 1.0), (1.0, 1.0), (0.0, 0.0)):
        run = whole_run(HISTOGRAM, setup, seed=1, frames=24, values={"search_share": share})
        assert run.summary().measures["held_at_end"] == found
        said = [row.searching for row in run.diagnostics]
        assert said[9:11] == ([None] * 2 if share == 0.0 else [True] * 2)
        assert not said[-1]


def test_cells_begin_with_the_first_look_and_do_not_learn_what_hides_it() -> None:
    """Switched on in mid-run they are those of the first picture; where they score too little nothing is learned."""
    pictures = textured(grey=True)
    setup = HISTOGRAM.video.on_video(pictures, Box.of(30, 48, 25, 25))
    late = Run(HISTOGRAM, setup, frames=6, timeline=[Change(0, {"cells_share": 0.0}), Change(3, {"cells_share": 0.5})])
    assert late.seek(2).state.learned is None
    assert late.seek(3).state.learned is not None
    state = Run(HISTOGRAM, setup, frames=6).seek(5).state
    assert not np.array_equal(state.learned.weights, first_cells(state.look).weights)
    assert judge(state, np.full((120, 200, 3), 120, np.uint8), setup.parameters).learned is state.learned
    assert judge(state, pictures.picture(5), setup.parameters).learned is not state.learned
