"""Single lessons: closed forms, figures and mistakes that their own checks do not cover."""

import math
from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.runs.reproduction import make
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.course import importance, kalman, monte_carlo, resampling, sir
from pftrack.teaching.lessons.course.importance import Proposal
from pftrack.teaching.lessons.course.probability import normal
from pftrack.teaching.lessons.course.recursion import GRID, Moment, RecursionParameters, moments
from pftrack.teaching.lessons.course.resampling import WEIGHTS
from pftrack.teaching.lessons.course.sir import CELLS_M, Corridor
from pftrack.teaching.lessons.lesson import question_recipe
from tests.teaching.lessons.demonstrations import asked_at, shown

LESSON = LESSONS["recursion"]


def last(**changes: Value) -> Moment:
    *_, newest = moments(GRID, RecursionParameters.model_validate(changes))
    return newest


def test_the_result_of_the_last_step_is_veiled() -> None:
    """The variance chart has all steps but the last, and no density after it.

    The question comes after ten predictions and a measurement: the variance has settled at 1, grows to 11 and ends
    below r. Without measurements it grows by q in each round.
    """
    variances = [moment.variance for moment in moments(GRID, asked_at(LESSON))]
    assert variances[8] == pytest.approx(1.0, abs=0.02)
    assert variances[18] == pytest.approx(11.0, abs=0.02)
    assert LESSON.answer(asked_at(LESSON), 1).exact == pytest.approx(1.692, abs=1e-3)
    figure = shown(LESSON, **LESSON.question.at).figure.without_answer()
    density, variance = figure.panels
    assert [trace.title for trace in density.traces] == ["before: predicted", "likelihood of the measurement 3.9 m"]
    assert max(float(np.max(trace.x)) for trace in variance.traces if trace.kind == "strip chart") == 18.0
    assert last(rounds=2, measurements=1, motion=1, hidden=True).variance == pytest.approx(11.0)


# Lesson 4: the cost of a guess.


def test_the_mode_jumps_where_the_lesson_says() -> None:
    """With 0.6 of the probability the second bump is still lower than the first, with 0.65 it is higher."""
    for weight, low, high in ((0.6, -0.1, 0.1), (0.65, 3.9, 4.1)):
        curve = shown(LESSONS["estimate"], weight=weight).figure.panels[0].traces[0]
        assert curve.kind == "curve"
        assert low <= curve.x[np.argmax(curve.y)] <= high


# Lesson 6: tracks whose velocity is never measured.


def test_the_ellipse_grows_and_tilts_while_frames_are_dropped() -> None:
    """Variances of position and velocity grow in each second of the gap, which has no dots and no gain."""
    known = kalman.apply_filter(0.05, 4.0, [*np.zeros(20), *np.full(20, np.nan), 0.0])
    covariances = known.covariances[19:40]
    correlations = covariances[:, 0, 1] / np.sqrt(covariances[:, 0, 0] * covariances[:, 1, 1])
    assert (np.diff(covariances[:, 0, 0]) > 0).all()
    assert (np.diff(covariances[:, 1, 1]) > 0).all()
    assert correlations[-1] > correlations[0] + 0.15
    assert known.covariances[40, 0, 0] < 4.0
    there = shown(LESSONS["kalman"], dropped=20, frame=30)
    dots = next(trace for trace in there.figure.panels[0].traces if trace.title == "measured")
    assert dots.kind == "scatter"
    assert not set(range(20, 40)) & set(dots.x)
    assert there.numbers[2].value == 0.0


# Lesson 7: clouds and the error of their mean.


@pytest.mark.parametrize(("small", "large"), [(10, 20), (70, 3000), (990, 1000)])
def test_a_smaller_cloud_is_the_beginning_of_a_larger_one(small: int, large: int) -> None:
    """A slider adds or removes samples without drawing others; neither do further axes."""
    one, few = monte_carlo.sample(5, small, 1, 3)
    other, many = monte_carlo.sample(5, large, 4, 3)
    assert (other[:small] == one).all()
    common = [size for size in monte_carlo.sizes_up_to(small) if size in monte_carlo.sizes_up_to(large)]
    assert many[: len(common), :, :1] == pytest.approx(few[: len(common)])


# Lesson 8's closed forms against integrals and draws.


@pytest.mark.parametrize("proposal", [Proposal(0, 2), Proposal(-1, 0.8)])
@pytest.mark.parametrize("order", [2, 4])
def test_moments_of_the_weight_are_integrals(proposal: Proposal, order: int) -> None:
    """E_q[(p/q)^k] is the integral of p^k / q^(k - 1)."""
    x = np.linspace(-12.0, 14.0, 20_001)
    p, q = normal(x, importance.MEAN, importance.SD), normal(x, proposal.centre, proposal.spread)
    with np.errstate(divide="ignore", invalid="ignore"):
        integrand = np.where(p > 0, p * (p / q) ** (order - 1), 0.0)
    assert proposal.moment(order) == pytest.approx(np.trapezoid(integrand, x), rel=1e-9)


def test_a_proposal_that_is_too_narrow_has_no_effective_share() -> None:
    """Below p's standard deviation over √2 the weights have infinite variance, and no scatter is stated."""
    assert math.isfinite(Proposal(0.0, 0.36).moment(2))
    for narrow in (Proposal(0.0, 0.35), Proposal(-3.0, 0.2)):
        assert narrow.share == 0.0
        assert narrow.share_sd(5000) is None
        assert narrow.mean_sd(5000) is None


@pytest.mark.parametrize(("proposal", "count"), [(Proposal(0.0, 1.0), 200), (Proposal(4.0, 4.0), 500)])
def test_the_scatter_is_as_stated(proposal: Proposal, count: int) -> None:
    """The standard deviations of share and mean are those of repeated draws, within 15 %."""
    clouds = [proposal.draw(Stream(3, repeat, Purpose.TRACK), count) for repeat in range(400)]
    shares = np.array([cloud.effective_sample_size for cloud in clouds]) / count
    means = np.array([cloud.weights @ cloud.states[:, 0] for cloud in clouds])
    assert shares.std() == pytest.approx(proposal.share_sd(count), rel=0.15)
    assert means.std() == pytest.approx(proposal.mean_sd(count), rel=0.15)


# Lesson 10: systematic and multinomial resampling, and the ancestors that remain.


@pytest.mark.parametrize("scheme", ["systematic", "stratified", "multinomial"])
@pytest.mark.parametrize("count", [2, 60])
def test_marks_pick_the_copies_that_are_shown(scheme: resampling.Scheme, count: int) -> None:
    """The count of teeth or darts on each particle's piece equals the copies that the resampler draws.

    The exact variance is that of 4,000 redraws, within five standard errors.
    """
    for offset, seed in ((0.0, 1), (0.37, 2), (0.99, 3)):
        hit = np.searchsorted(count * np.cumsum(WEIGHTS), resampling.marks(scheme, count, offset, seed), side="right")
        copies = resampling.copies(scheme, count, offset, seed)
        assert np.bincount(hit, minlength=len(WEIGHTS)).tolist() == copies.tolist()
    squared = np.square(resampling.sample_copies(scheme, count, 4000, 5) - count * WEIGHTS).sum(axis=1)
    error = 5 * squared.std() / 4000**0.5 + 1e-9
    assert squared.mean() == pytest.approx(resampling.exact_variance(scheme, count), abs=error)


def test_all_descend_from_few() -> None:
    """The tree's strong lines end in the counted ancestors; without resampling the effective size falls for good."""
    shown = resampling.show(resampling.ResamplingParameters(particles=60), 2)
    tree = next(panel for panel in shown.figure.panels if panel.id == "tree").traces[0]
    assert np.isnan(tree.parents[0]).all()
    assert (tree.weights[-1] == 1.0).all()
    assert (tree.weights[0] == 1.0).sum() == shown.numbers[1].value < 20
    for step in range(1, len(tree.parents)):
        strong = tree.parents[step, tree.weights[step] == 1.0].astype(int)
        assert set(strong) == set(np.flatnonzero(tree.weights[step - 1] == 1.0))
    kept, again = resampling.effective_sizes("systematic", 1)
    assert kept[-1] < 0.05 * kept[0]
    assert again[-1] > 0.5 * again[0]


# Lesson 9: the corridor.


def test_the_likelihood_is_that_of_the_lesson() -> None:
    """p(door | x) is 0.05 + 0.9 exp(-((x - d) / 1.5)^2 / 2) for the nearest door, and 0 outside."""
    corridor = Corridor()
    here = np.array([12.0, 13.5, 60.0, -0.1, 100.1])
    sensed = corridor.likelihood(here, door=True)
    assert sensed == pytest.approx([0.95, 0.05 + 0.9 * np.exp(-0.5), 0.05, 0.0, 0.0], abs=1e-9)
    assert corridor.likelihood(here, door=False)[:3] == pytest.approx(1.0 - sensed[:3])


@pytest.mark.parametrize("corridor", [Corridor(), Corridor(0.1, 1.0), Corridor(3.0, 0.0)])
def test_densities_have_the_area_one(corridor: Corridor) -> None:
    """This holds in every step, for any noise and sensor."""
    _, exact = sir.cached_walk(corridor)
    assert exact.given.sum(axis=1) * sir.CELL_M == pytest.approx(np.ones(sir.STEPS + 1))
    assert exact.predicted.sum(axis=1) * sir.CELL_M == pytest.approx(np.ones(sir.STEPS))
    assert (exact.given >= 0.0).all()


def test_without_a_sensor_the_density_only_moves_on() -> None:
    """With a sensor that guesses, the density after 12 steps of 3 m is uniform from 36 m on."""
    after = sir.cached_walk(Corridor(0.6, 0.0))[1].given[-1]
    assert after[CELLS_M < 25.0].max() < 1e-6
    assert after[(CELLS_M > 46.0) & (CELLS_M < 99.0)] == pytest.approx(1.0 / (sir.LENGTH_M - 36.0), rel=0.02)


# Lesson 12: its question about a run.

COLOUR_LESSON = LESSONS["colour"]


def test_the_question_is_about_a_sharper_likelihood_in_the_scenario() -> None:
    """The run of the question differs from the scenario's own in lambda only."""
    recipes = COLOUR_LESSON.body.recipe, question_recipe(COLOUR_LESSON)
    shown, about = (make(recipe).parameters_at(0) for recipe in recipes)
    assert (shown.sharpness, about.sharpness) == (20, 200)
    assert shown.model_copy(update={"sharpness": 200}) == about


def test_an_answer_counts_the_frames_that_there_are() -> None:
    """A run that holds its target is never lost, and one that never held it is lost from frame 0."""
    run = make(question_recipe(COLOUR_LESSON))
    run.seek(2)
    rows = run.diagnostics
    run.diagnostics = [replace(row, lost=lost) for row, lost in zip(rows, (False, True, False), strict=True)]
    assert COLOUR_LESSON.answer(run).exact == 3
    run.diagnostics = [replace(row, lost=True) for row in rows]
    assert COLOUR_LESSON.answer(run).exact == 0
