"""The trackers by colour histograms: their equations, and the checks of the lecture's last lesson."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import Frame, Target
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.histogram.experiment import TRACKERS
from pftrack.experiments.histogram.look import first_look, model_of
from pftrack.experiments.histogram.model import MODEL, SIZE, judge
from pftrack.experiments.histogram.parameters import HistogramTrackerParameters
from pftrack.runs.many import outcomes
from pftrack.runs.run import Run
from pftrack.vision.likelihoods.histogram import Window, fit, similarity

LAWN = find("histogram")
NAMES = [name for name in TRACKERS if name != "greedy"]


def run_of(tracker: str, frames: int, seed: int = 0, /, **values: Any) -> Run:
    timeline = (Change(0, values),) if values else ()
    return Run(LAWN, LAWN.simulate(), tracker=tracker, seed=seed, frames=frames, timeline=timeline)


def patch(column: int, row: int) -> Frame:
    """A red and yellow square on green."""
    image = np.full((80, 120, 3), (40, 160, 60), np.uint8)
    image[max(row - 8, 0) : row, max(column - 8, 0) : column + 9] = (200, 40, 40)
    image[max(row, 0) : row + 9, max(column - 8, 0) : column + 9] = (210, 190, 40)
    return Frame(0, 0.0, image_rgb=image)


SMALL = revise(HistogramTrackerParameters(), {"window_width_px": 17, "window_height_px": 17, "sample_count": 200})


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
    after = TRACKERS["condensation"].step(state, patch(40, 40), still, Stream(1, 1, Purpose.TRACK))
    parents = state.particles.states[after.particles.ancestors]
    kept = still.velocity_retention * parents[:, 2:4]
    assert np.allclose(after.particles.states[:, 2:4], kept, rtol=0, atol=1e-12)
    assert np.allclose(after.particles.states[:, :2], parents[:, :2] + kept, rtol=0, atol=0.06)


def test_weights_are_the_likelihood() -> None:
    """After resampling the log weights are -lambda (1 - rho) up to a constant, and frame 0 is weighed as well."""
    state = begun()
    for frame, old in ((patch(40, 40), state), (patch(43, 41), None)):
        new = old or TRACKERS["condensation"].step(state, frame, SMALL, Stream(1, 1, Purpose.TRACK))
        scores = MODEL.log_likelihood(new.particles.states, frame, SMALL, new)
        off = new.particles.log_weights - scores
        assert np.ptp(off) < 1e-9
        rho = similarity(frame.image_rgb, new.particles.states[5, :2], new.first_window, "hsv", new.model)
        assert scores[5] == pytest.approx(-20 * (1 - rho))


@pytest.mark.parametrize("tracker", TRACKERS)
def test_it_follows_what_moves(tracker: str) -> None:
    """Each tracker is on a square that moves by 2 px a frame, and believes in a box of the window's size."""
    state = begun(tracker=tracker)
    for index in range(1, 12):
        frame = patch(40 + 2 * index, 40)
        state = TRACKERS[tracker].step(state, frame, SMALL, Stream(1, index, Purpose.TRACK))
    assert np.hypot(*(state.estimate - [62, 40])) < 2.5
    assert state.box_px == (17.0, 17.0)
    assert state.likeness > 0.9
    assert not state.searching


def test_greedy_search_finds_the_exact_place_within_reach() -> None:
    """It goes to the very pixel within its reach, and no further."""
    greedy = TRACKERS["greedy"]
    state = greedy.step(begun(tracker="greedy"), patch(47, 36), SMALL, Stream(1, 1, Purpose.TRACK))
    assert state.estimate.tolist() == [47.0, 36.0]
    state = greedy.step(begun(tracker="greedy"), patch(55, 40), SMALL, Stream(1, 1, Purpose.TRACK))
    assert abs(state.estimate[0] - 40) <= 8


@pytest.mark.parametrize(("scale", "expected"), [(1.5, 1.5), (0.7, 0.7)])
def test_the_size_is_followed(scale: float, expected: float) -> None:
    """A target that grows or shrinks little by little takes its window along; switched off, the size stays."""
    parameters = revise(SMALL, {"follow_size": True, "sample_count": 500, "sharpness": 60})
    off = abs(np.mgrid[:80, :120] - 40).max(axis=0)

    def framed(size: float) -> Frame:
        """A yellow square in a red frame: a part of it has other shares than all of it."""
        image = np.full((80, 120, 3), (40, 160, 60), np.uint8)
        image[off < 8.5 * size], image[off < 5.5 * size] = (200, 40, 40), (210, 190, 40)
        return Frame(0, 0.0, image_rgb=image)

    target = Target(np.array([40.0, 40.0]), 17.0)
    state = TRACKERS["condensation"].start(target, framed(1.0), parameters, Stream(1, 0, Purpose.START))
    for index in range(1, 31):
        frame = framed(1 + (scale - 1) * index / 30)
        state = TRACKERS["condensation"].step(state, frame, parameters, Stream(1, index, Purpose.TRACK))
    assert state.box_px[0] / 17 == pytest.approx(expected, rel=0.15)
    fixed = revise(parameters, {"follow_size": False})
    after = TRACKERS["condensation"].step(state, frame, fixed, Stream(1, 31, Purpose.TRACK))
    kept = state.particles.states[after.particles.ancestors, SIZE]
    assert np.array_equal(after.particles.states[:, SIZE], kept)


def test_another_space_is_counted_from_the_first_look() -> None:
    """Choosing another space or kernel in mid-run gives the model that a run begun with it has."""
    state = begun()
    for values in ({"colour_space": "lab"}, {"spatial_kernel": True}, {"colour_space": "chromaticity"}):
        parameters = revise(SMALL, values)
        after = TRACKERS["condensation"].step(state, patch(40, 40), parameters, Stream(1, 1, Purpose.TRACK))
        assert np.array_equal(after.model, begun(parameters).model)


def test_the_model_is_renewed_only_where_it_is_sure() -> None:
    """It follows slow changes at the estimate, and keeps still while the target is hidden or the cloud is wide."""
    renewing = revise(SMALL, {"renewal_rate": 0.2})
    state = begun(renewing)
    assert not np.array_equal(state.model, begun().model) or state.likeness == pytest.approx(1.0)
    darker = patch(40, 40)
    darker.image_rgb[40:49, 32:49] = (200, 120, 40)
    seen = TRACKERS["condensation"].step(state, darker, renewing, Stream(1, 1, Purpose.TRACK))
    assert seen.model.sum() == pytest.approx(1, abs=1e-12)
    green = Frame(1, 0.0, image_rgb=np.full((80, 120, 3), (40, 160, 60), np.uint8))
    hidden = TRACKERS["condensation"].step(state, green, renewing, Stream(1, 1, Purpose.TRACK))
    assert np.array_equal(hidden.model, state.model)


def test_what_is_lost_is_searched_and_found() -> None:
    """After some frames without it the tracker says that it searches, spreads, and begins again where the target is."""
    parameters = revise(SMALL, {"search_share": 1.0, "lost_after_frames": 3})
    tracker, state = TRACKERS["condensation"], begun(parameters)
    empty = Frame(1, 0.0, image_rgb=np.full((80, 120, 3), (40, 160, 60), np.uint8))
    searching = []
    for index in range(1, 7):
        state = tracker.step(state, empty, parameters, Stream(1, index, Purpose.TRACK))
        searching.append(tracker.searching(state))
    assert searching == [False, False, True, True, True, True]
    assert state.sigma.min() > 15
    state = tracker.step(state, patch(95, 25), parameters, Stream(1, 7, Purpose.TRACK))
    assert not tracker.searching(state)
    assert np.hypot(*(state.estimate - [95, 25])) < 4
    for index in range(8, 12):
        state = tracker.step(state, patch(95, 25), parameters, Stream(1, index, Purpose.TRACK))
    assert np.hypot(*(state.estimate - [95, 25])) < 2
    given_up = revise(parameters, {"search_share": 0.0})
    never = tracker.searching(tracker.step(state, empty, given_up, Stream(1, 12, Purpose.TRACK)))
    assert never is None, "one that never looks for its target does not say that it follows"


def test_a_window_outside_the_picture_weighs_nothing() -> None:
    """Particles beyond the picture, or of impossible size, have rho 0, and a cloud of such alone stays uniform."""
    state = begun()
    states = state.particles.states.copy()
    states[0, 0], states[1, SIZE], states[2, 0] = -500.0, 3.0, np.nan
    scores = MODEL.log_likelihood(states, patch(40, 40), SMALL, state)
    assert scores[:3].tolist() == [-20.0] * 3
    assert (scores[3:] > -20.0).all()


def test_a_target_outside_the_picture_is_refused() -> None:
    """A start of which too little lies within the picture is refused with the reason."""
    target = Target(np.array([-30.0, 40.0]), 17.0)
    with pytest.raises(ValueError, match="a quarter of the target's window"):
        TRACKERS["condensation"].start(target, patch(40, 40), SMALL, Stream(1, 0, Purpose.START))


@pytest.mark.parametrize("space", ["hsv", "lab"])
def test_a_picture_without_colour_is_followed_by_brightness(space: str) -> None:
    """A bright square on dark grey is followed where a space does not leave brightness out."""
    parameters = revise(SMALL, {"colour_space": space})
    tracker = TRACKERS["condensation"]

    def grey(column: int) -> Frame:
        image = np.full((80, 120, 3), 60, np.uint8)
        image[32:49, column - 8 : column + 9] = 180
        return Frame(0, 0.0, image_rgb=image)

    state = tracker.start(Target(np.array([40.0, 40.0]), 17.0), grey(40), parameters, Stream(1, 0, Purpose.START))
    for index in range(1, 12):
        state = tracker.step(state, grey(40 + index), parameters, Stream(1, index, Purpose.TRACK))
    assert np.hypot(*(state.estimate - [51, 40])) < 2


@pytest.mark.slow
def test_lambda_and_velocity_decide_as_the_lesson_says() -> None:
    """Scene 0, 30 runs each: success 1.00 at lambda 20, 0 at lambda 200, and greedy search fails."""
    seeds = list(range(30))

    def rate(tracker: str, **values: Any) -> float:
        found = outcomes(LAWN, LAWN.simulate(), values=values, trackers=[tracker], seeds=seeds, frames=120)
        return float(np.mean([one[0].success for one in found]))

    assert rate("condensation") >= 0.95
    assert rate("condensation", sharpness=200) <= 0.2
    assert not run_of("greedy", 120).seek(119).diagnostics.error < 14


def test_a_wide_cloud_renews_nothing() -> None:
    """The same picture renews the model of a narrow cloud, and not that of a cloud above the limit."""
    darker = patch(40, 40)
    darker.image_rgb[40:44, 32:49] = (200, 120, 40)
    for spread, renewed in ((10.0, True), (0.0, False)):
        values = {"renewal_rate": 0.2, "renewal_likeness": 0.3, "renewal_spread": spread}
        parameters = revise(SMALL, values)
        state = begun()
        after = TRACKERS["condensation"].step(state, darker, parameters, Stream(1, 1, Purpose.TRACK))
        assert np.array_equal(after.model, state.model) is not renewed


def test_only_what_is_alike_enough_is_found() -> None:
    """A place between the two likenesses, of loss and of finding, is looked at and not taken."""
    values = {"search_share": 1.0, "lost_after_frames": 1, "lost_likeness": 0.3, "found_likeness": 0.95}
    tracker, state = TRACKERS["condensation"], begun()
    empty = Frame(1, 0.0, image_rgb=np.full((80, 120, 3), (40, 160, 60), np.uint8))
    parameters = revise(SMALL, values)
    state = tracker.step(state, empty, parameters, Stream(1, 1, Purpose.TRACK))
    half = patch(95, 25)
    half.image_rgb[25:34, 87:104] = (200, 40, 40)
    after = tracker.step(state, half, parameters, Stream(1, 2, Purpose.TRACK))
    assert 0.3 < after.likeness < 0.95
    assert tracker.searching(after)
    easier = revise(parameters, {"found_likeness": 0.5})
    assert not tracker.searching(tracker.step(state, half, easier, Stream(1, 2, Purpose.TRACK)))


@pytest.mark.parametrize("noise", [0.0, 0.1])
def test_sizes_diffuse_by_their_noise(noise: float) -> None:
    """The logarithm of the size is a random walk with the standard deviation that is asked for."""
    parameters = revise(SMALL, {"follow_size": True, "size_noise": noise, "sample_count": 2000})
    state = begun(parameters)
    after = TRACKERS["condensation"].step(state, patch(40, 40), parameters, Stream(1, 1, Purpose.TRACK))
    walked = after.particles.states[:, SIZE] - state.particles.states[after.particles.ancestors, SIZE]
    assert walked.std() == pytest.approx(noise, rel=0.1)


@pytest.mark.parametrize("column", [0.0, -3.0, -4.0])
def test_a_target_at_the_edge_is_seen_as_in_the_picture(column: float) -> None:
    """The model of a clipped first look is that of the window in the whole picture."""
    image = patch(40, 40).image_rgb
    image[36:40, 0:3] = (10, 20, 230)
    image[30:50, 3:6] = (230, 20, 230)
    for kernel in (False, True):
        place = np.array([column, 40.0])
        expected = fit(image, place, Window(8, 8, kernel), "hsv")
        assert np.array_equal(model_of(first_look(image, place, SMALL), "hsv", kernel, (1, 1)), expected)


def test_misses_count_only_in_a_row_and_renewal_takes_its_share() -> None:
    """A frame that shows the target again clears the misses; the new model is (1 - r) q + r p."""
    image = patch(40, 40).image_rgb
    state = replace(begun(), missed=5)
    assert judge(state, image, SMALL).missed == 0
    assert judge(state, np.full_like(image, 90), SMALL).missed == 6
    old = np.full(110, 1 / 110)
    renewing = revise(SMALL, {"renewal_rate": 0.2, "renewal_likeness": 0, "renewal_spread": 10})
    seen = judge(replace(state, model=old), image, revise(renewing, {"renewal_rate": 1})).model
    assert judge(replace(state, model=old), image, renewing).model == pytest.approx(0.8 * old + 0.2 * seen)


def test_giving_up_the_search_goes_back_to_tracking() -> None:
    """A search that is switched off ends with the next frame, from the particles that it has."""
    empty = Frame(1, 0.0, image_rgb=np.full((80, 120, 3), (40, 160, 60), np.uint8))
    state = replace(begun(), searching=True, missed=50)
    after = TRACKERS["condensation"].step(state, empty, SMALL, Stream(1, 1, Purpose.TRACK))
    assert not after.searching
    assert np.hypot(*(after.estimate - [40, 40])) < 6


def test_greedy_search_never_says_that_it_searches() -> None:
    """It stays at the best place near by, so its caption does not speak of a search when the window looks wrong."""
    captions = {}
    for tracker in ("greedy", "condensation"):
        run = run_of(tracker, 4, search_share=1.0, lost_likeness=1.0, lost_after_frames=1, found_likeness=1.0)
        captions[tracker] = LAWN.draw(run.finish(), run.diagnostics).caption
    assert "searching" in captions["condensation"]
    assert "searching" not in captions["greedy"]


def test_the_window_has_the_size_of_the_estimate() -> None:
    """The window grows with the scale, and greedy search keeps the size that it is handed."""
    state = begun(tracker="greedy")
    mean = state.posterior.mean.copy()
    mean[SIZE] = np.log(1.5)
    state = replace(state, posterior=replace(state.posterior, mean=mean))
    assert state.window == Window(12, 12)
    after = TRACKERS["greedy"].step(state, patch(40, 40), SMALL, Stream(1, 1, Purpose.TRACK))
    assert after.box_px == pytest.approx((25.5, 25.5))


def test_what_is_found_is_found_without_an_offset() -> None:
    """The cloud that begins again lies around the place in the picture, and not half a step beside it."""
    big = revise(HistogramTrackerParameters(), {"window_width_px": 61, "window_height_px": 61, "search_share": 1.0})
    image = np.full((240, 320, 3), (40, 160, 60), np.uint8)
    image[90:151, 100:161] = (200, 40, 40)
    tracker = TRACKERS["condensation"]
    state = tracker.start(
        Target(np.array([130.0, 120.0]), 61.0), Frame(0, 0.0, image_rgb=image), big, Stream(1, 0, Purpose.START)
    )
    # Cells of 10 px have their middles at 5, 15, ...
    moved = np.roll(image, (5, 5), (0, 1))
    after = tracker.step(
        replace(state, searching=True), Frame(1, 0.1, image_rgb=moved), big, Stream(1, 1, Purpose.TRACK)
    )
    assert not after.searching
    assert np.hypot(*(after.estimate - [135, 125])) < 2


@pytest.mark.parametrize(
    "values", [{"renewal_rate": 0.1}, {"search_share": 1.0}, {"follow_size": True}, {"follow_camera": True}]
)
def test_what_is_decided_between_frames_is_not_folded(values: dict[str, Any]) -> None:
    """Renewal, search, size and camera take frames one by one."""
    parameters, pictures = revise(SMALL, values), np.stack([patch(40, 40).image_rgb] * 2)
    fold = TRACKERS["condensation"].fold
    assert fold is not None
    assert fold(begun(parameters), pictures, parameters, 1, 1) is None


def test_velocities_that_nothing_is_added_to_die_out() -> None:
    """Without noise on the velocity resampling leaves ever fewer different ones; with some, all stay different."""
    counts = {}
    for noise in (0.0, 0.3):
        run = run_of("condensation", 25, velocity_noise_px=noise)
        run.finish()
        counts[noise] = [row.number("velocities") for row in run.diagnostics]
    assert counts[0.3] == [300.0] * 25
    assert counts[0.0][0] == 300.0
    assert all(later <= earlier for earlier, later in pairwise(counts[0.0]))
    assert counts[0.0][-1] < 30


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
    after = TRACKERS["condensation"].step(state, patch(40, 40), wide, Stream(1, 1, Purpose.TRACK))
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
            state = TRACKERS[tracker].start(
                Target(np.array([68.0, 58.0]), 17.0),
                Frame(0, 0.0, image_rgb=first),
                parameters,
                Stream(1, 0, Purpose.START),
            )
            state = TRACKERS[tracker].step(
                state, Frame(1, 0.1, image_rgb=later), parameters, Stream(1, 1, Purpose.TRACK)
            )
            off[tracker, follow] = float(np.hypot(*(state.estimate - (88.0, 68.0))))
    assert max(off["condensation", True], off["greedy", True]) < 3
    assert min(off["condensation", False], off["greedy", False]) > 10


def test_ways_of_counting_may_change_in_mid_run() -> None:
    """Parts, weights and contrast take effect in the next frame, and back again."""
    state, plain = begun(), begun()
    parts = revise(SMALL, {"parts_across": 2, "parts_down": 3, "weigh_background": True, "surround_contrast": 0.2})
    state = TRACKERS["condensation"].step(state, patch(40, 40), parts, Stream(1, 1, Purpose.TRACK))
    assert state.parts == (2, 3)
    assert len(state.model) == 6 * len(plain.model)
    assert np.allclose(state.whole_model, plain.model)
    assert state.background.contrast == 0.2
    state = TRACKERS["condensation"].step(state, patch(40, 40), SMALL, Stream(1, 2, Purpose.TRACK))
    assert np.array_equal(state.model, plain.model)
    assert state.background_use == (False, 0.0)
