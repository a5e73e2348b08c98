"""The driver's head: Bando 2007, ch. 4 section 4, on a simulated head (docs/methods/heads.md).

Eleven templates in two layers, three drivers, with the mean of other people as the face model or the driver's own face.
Bando's claims: the adaptive mixture is clearly best; the features' own prediction alone loses features whose look
changes; the head's prediction alone fails when its assumptions break; the driver's own face gives more successes at
small thresholds.

The difficulty of a driver depends on the face: on its distance from the mean, and on the features that it hides when it
turns. The seeds of the reference's drivers are known, but not the order of the draws, so ours are other people. Driver
99 comes out alike. Our 101 has a nose 8 mm shorter than the mean, so steep that it hides the inner corners of the eyes
when the head turns. Our 102 has one 6 mm longer and 4 mm flatter, and the nose is most of what tells a nod from a
change of
scale: with the own nose alone in the mean model the error of the pitch falls from 6.7 to 2.3 degrees. So `head_people`
also compares medians over people, which do not depend on a single face.

The head's prediction alone is lost at once or not at all, by how fast the head is and how well the model fits. With
driver 99 that happens between 1.25 and 1.5 times Bando's speed here, and at Bando's speed there.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from pftrack.core.arrays import Bools, Floats
from pftrack.core.model.parameters import Value, revise
from pftrack.core.model.recipe import Change
from pftrack.core.model.source import History
from pftrack.core.numerics.elementary import wrap
from pftrack.experiments import find
from pftrack.experiments.head.appearance import EYE_DISTANCE_PX
from pftrack.experiments.head.detection import eye_distance
from pftrack.experiments.head.parameters import AS_PUBLISHED
from pftrack.experiments.head.scene import SCRIPT_FRAMES
from pftrack.experiments.shared.pose.methods import Method
from pftrack.output.figures import style
from pftrack.reproduce.finding import Findings, References, mean_of, three_errors
from pftrack.reproduce.head_turns import turns
from pftrack.reproduce.pool import Pool
from pftrack.runs.many import KeptFrames, side_by_side
from pftrack.runs.run import Run
from pftrack.vision.face import FEATURES, TITLES, fit_similarity, mean_model, person

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Model: TypeAlias = Literal["mean", "individual", "growing"]
"""Which face is assumed: the mean of other people, the driver's own, or one that grows from the mean to that."""

REFERENCES = References(__file__)
METHODS: tuple[Method, ...] = ("pf-asd", "alpha-1", "alpha-0")
MODELS: tuple[Model, ...] = ("mean", "individual")
AXES = ("pitch", "yaw", "roll")
VIDEO_SEED = 0
TURNED_DEG = 20.0
"""The head counts as turned with an axis beyond this (fig. 4.15)."""

RUNS = 20
TOLERANCE_DEG, QUICK_WIDER = 0.4, 1.75
"""The latter of one axis in two trials."""

ABOVE_DEG = 3.0
FASTER_FRAMES, FASTER_TRIALS = 600, 5
"""Bando's script is given 900 frames; with 600 the head's prediction alone is always lost."""


@dataclass(frozen=True, slots=True)
class Trial:
    """A trial on a video.

    Attributes:
        method: Method of tracking.
        model: The face that is assumed.
        seed: Seed of the tracker.
    """

    method: Method
    model: Model
    seed: int


@dataclass(frozen=True, slots=True)
class VideoTrials:
    """A video and all that is run on it.

    Attributes:
        driver: The person's seed.
        trials: Trials to run.
        frames: Number of frames for the script of motions; with fewer the head is faster.
    """

    driver: int
    trials: tuple[Trial, ...]
    frames: int = SCRIPT_FRAMES


@dataclass(frozen=True, slots=True)
class TrialResult:
    """Measurements of a trial.

    Attributes:
        trial: The trial.
        errors_deg: (3,) mean absolute error of nod, turn and roll.
        feature_px: Mean distance of the features from the truth.
        ratios: (frames - 1, 11) alpha by which each feature's particles were drawn.
        turned: (frames - 1,) whether the head was turned.
    """

    trial: Trial
    errors_deg: Floats
    feature_px: float
    ratios: Floats
    turned: Bools

    @property
    def error_deg(self) -> float:
        """Mean of the three angles' errors."""
        return float(self.errors_deg.mean())


def run_trials(work: VideoTrials) -> list[TrialResult]:
    """Show the video to all trials, and measure."""
    head = find("head")
    setup = head.simulate()
    scene: dict[str, Value] = {"person": work.driver, "speed": SCRIPT_FRAMES / work.frames}
    parameters = revise(setup.parameters, scene)
    video = setup.open_source(VIDEO_SEED, parameters)
    if video.start.landmarks is None:
        raise RuntimeError("the simulated head knows its features")
    scale = EYE_DISTANCE_PX / eye_distance(video.start.landmarks.points_px)
    kept = KeptFrames(video, History(((0, parameters),)))
    shared = replace(setup, open_source=lambda *_: kept)
    found = []
    for model in dict.fromkeys(trial.model for trial in work.trials):
        trials = [trial for trial in work.trials if trial.model == model]
        face = "personal" if model == "individual" else model
        begun = Change(0, {**scene, **AS_PUBLISHED, "face_model": face, "template_scale": scale})
        cases = [(trial.method, trial.seed) for trial in trials]
        runs = side_by_side(head, shared, cases, changes=(begun,), frames=work.frames)
        found += [_measure(trial, run) for trial, run in zip(trials, runs, strict=True)]
    return found


def _measure(trial: Trial, run: Run) -> TrialResult:
    rows = run.diagnostics[1:]
    truth = np.array([row.truth for row in rows])
    off = wrap(np.deg2rad(np.array([row.estimate for row in rows]) - truth))
    # Alpha is what was learned up to a frame; the particles of the next one are drawn by it.
    unknown = (np.nan,) * len(FEATURES)
    return TrialResult(
        trial,
        np.rad2deg(np.abs(off).mean(axis=0)),
        float(np.mean([row.vector("feature_error_px") for row in rows])),
        np.array([row.vector("alpha") or unknown for row in run.diagnostics[:-1]]),
        np.abs(truth).max(axis=1) > TURNED_DEG,
    )


def distance_mm(driver: int) -> float:
    """Return the root mean square distance of a driver's points from the mean model's after alignment, mm."""
    own, mean = person(driver).points_mm, mean_model().points_mm
    apart = fit_similarity(own, mean)(own) - mean
    return float(np.sqrt(np.square(apart).sum(axis=1).mean()))


# For a success curve, the share of trials whose error on an axis is below a threshold (fig. 4.16), the *place* is
# compared: by how much the curve has to be moved along the thresholds to agree with the reference at all thresholds
# that are known. A curve is steep: all trials of a method see the same video, and their errors lie within a few tenths
# of a degree. A rate at one threshold therefore says little about another renderer.

SLACK = 0.1
"""Two trials of twenty may be on the other side of a threshold."""

FARTHEST_DEG, STEP_DEG = 3.0, 0.01
GAIN_AT = {"pitch": 1.5, "yaw": 2.0}
"""Thresholds in degrees at which the reference's own face succeeds and the mean model does not."""


def success_rates(courses: Sequence[TrialResult], axis: int, thresholds_deg: Floats) -> Floats:
    """Return the share of trials whose mean absolute error on an axis is below each threshold, (n,)."""
    errors = np.array([course.errors_deg[axis] for course in courses])
    rates: Floats = (errors < thresholds_deg[:, None]).mean(axis=1)
    return rates


def curves(by_model: dict[Model, list[TrialResult]]) -> Findings:
    """Compare the curves of driver 99, tracked by the mixture, given the trials by face model."""
    for model, (axis, name) in product(MODELS, enumerate(AXES)):
        rates = REFERENCES.table("rates")[model][name]
        moved = _distance_deg(by_model[model], axis, np.array(list(rates)), np.array(list(rates.values())))
        yield REFERENCES.judge("curve", moved, model, name)
    for name, threshold in GAIN_AT.items():
        axis, at = AXES.index(name), np.array([threshold])
        own, other = (success_rates(by_model[model], axis, at)[0] for model in ("individual", "mean"))
        yield REFERENCES.judge("curve-gain", own - other, name, threshold)


def _distance_deg(courses: Sequence[TrialResult], axis: int, thresholds: Floats, references: Floats) -> float:
    """Return by how little a curve has to be moved, to one side or the other, to meet the reference."""
    for moved in np.arange(0.0, FARTHEST_DEG, STEP_DEG):
        low = success_rates(courses, axis, thresholds - moved)
        high = success_rates(courses, axis, thresholds + moved)
        if (low - SLACK <= references).all() and (references <= high + SLACK).all():
            return float(moved)
    return float("nan")


MODEL_COLOURS: dict[Model, str] = {"individual": style.CURVE_COLOURS[0], "mean": style.CURVE_COLOURS[1]}
NAMES: dict[Model, str] = {"individual": "the driver's own face", "mean": "mean face of other people"}
MOST_DEG = 4.0
HIDDEN: dict[str, Any] = {"color": style.INK["hidden"], "alpha": 0.2, "linewidth": 0}


def draw(by_model: dict[Model, list[TrialResult]]) -> "dict[str, Figure]":
    """Return the figures by name, given the trials of one driver with the mixture, by face model."""
    return {
        "figure-4.15-alpha": alpha_over_time(by_model["mean"]),
        "figure-4.16-success-by-threshold": success_by_threshold(by_model),
    }


def alpha_over_time(courses: list[TrialResult]) -> "Figure":
    """Draw alpha of each feature, the mean of all trials, shaded where the head is turned."""
    ratios = np.mean([course.ratios for course in courses], axis=0)
    frames = np.arange(1, len(ratios) + 1)
    figure, panels = style.new_figure(6.0, rows=4, columns=3, share="xy")
    for panel, name, values in zip(panels, FEATURES, ratios.T, strict=False):
        panel.fill_between(frames, 0.0, 1.0, where=courses[0].turned, **HIDDEN)
        panel.plot(frames, values, color=MODEL_COLOURS["individual"], linewidth=0.8)
        style.write_title(panel, TITLES[name].capitalize())
    panels[11].set_visible(False)
    panels[8].tick_params(labelbottom=True)
    figure.supxlabel("Frame", fontsize=style.TITLE_PT)
    figure.supylabel("alpha, share of the head's prediction", fontsize=style.TITLE_PT)
    style.write_heading(figure, "Alpha of each feature; shaded where the head is turned by more than 20°")
    return figure


def success_by_threshold(by_model: dict[Model, list[TrialResult]]) -> "Figure":
    """Draw the success of each axis over the threshold, of both face models."""
    thresholds = np.linspace(0.0, MOST_DEG, 401)
    figure, panels = style.new_figure(3.2, columns=len(AXES), share="y")
    for axis, (panel, name) in enumerate(zip(panels, AXES, strict=True)):
        for model, colour in MODEL_COLOURS.items():
            rates = success_rates(by_model[model], axis, thresholds)
            panel.plot(thresholds, rates, color=colour, linewidth=1.5, label=NAMES[model])
        style.write_title(panel, name.capitalize())
        panel.set_xlabel("Threshold of the mean error, °")
    panels[0].set_ylabel("Success rate")
    panels[0].set_ylim(-0.02, 1.02)
    style.explain_below(figure, panels[0], 2)
    style.write_heading(figure, f"Trials below a threshold, PF-ASD, {len(by_model['mean'])} trials")
    return figure


Courses: TypeAlias = dict[tuple[int, Model, Method], list[TrialResult]]


def pose(pool: Pool, full: bool) -> Findings:
    """Errors of three methods on three drivers with two face models, their ratios and success curves."""
    courses = _courses(pool, full)
    drivers = REFERENCES.table("distance")
    yield from REFERENCES.judge_all("distance", {driver: distance_mm(driver) for driver in drivers})
    yield from _axes(courses, full=full)
    for driver in drivers if full else (99,):
        yield from _orders(courses, driver)
    if not full:
        return
    first = {model: courses[99, model, "pf-asd"] for model in MODELS}
    pool.draw(lambda: draw(first))
    yield from _table(courses)
    yield from _ratios(courses)
    yield from curves(first)
    yield from _faster(pool)
    yield from people(pool)
    yield from growth(pool)
    yield from turns(pool)


def _courses(pool: Pool, full: bool) -> Courses:
    if full:
        work = [
            VideoTrials(driver, tuple(Trial(method, model, seed) for method in METHODS for seed in range(RUNS)))
            for model, driver in product(MODELS, REFERENCES.table("distance"))
        ]
    else:
        mixture = tuple(Trial("pf-asd", model, seed) for model in MODELS for seed in range(2))
        work = [VideoTrials(99, (*mixture, Trial("alpha-0", "mean", 0)))]
    courses: Courses = {}
    for given, outcomes in zip(work, pool.map(run_trials, work), strict=True):
        for course in outcomes:
            key = (given.driver, course.trial.model, course.trial.method)
            courses.setdefault(key, []).append(course)
    return courses


def _axes(courses: Courses, *, full: bool) -> Findings:
    for model in MODELS:
        found = courses[99, model, "pf-asd"]
        errors = dict(zip(AXES, np.mean([course.errors_deg for course in found], axis=0), strict=True))
        yield REFERENCES.judge("error", mean_of(one.error_deg for one in found), model)
        yield from REFERENCES.judge_all("axis", errors, model, wider=1.0 if full else QUICK_WIDER)
        yield REFERENCES.judge("features", mean_of(course.feature_px for course in found), model)


def _orders(courses: Courses, driver: int) -> Findings:
    """Judge what the reference asserts of every driver, as far as the methods have been run."""
    own, other = courses[driver, "individual", "pf-asd"], courses[driver, "mean", "pf-asd"]
    median = float(np.median([course.error_deg for course in other]))
    limits: dict[Method, float] = {"alpha-0": 0.6, "alpha-1": 0.3}
    for method, limit in limits.items():
        if (driver, "mean", method) in courses:
            ratio = median / mean_of(one.error_deg for one in courses[driver, "mean", method])
            yield REFERENCES.judge("order", ratio, driver, method, holds=ratio < limit, limit=limit)
    astray = np.mean([course.error_deg > 2.0 * median for course in other])
    gain = mean_of(one.error_deg for one in other) - mean_of(one.error_deg for one in own)
    yield REFERENCES.judge("astray", astray, driver)
    yield REFERENCES.judge("own-face", gain, driver)


def _table(courses: Courses) -> Findings:
    """Judge the error and how many trials are lost, in every cell.

    The tolerance that is stated is for trials that are not lost. Where the reference loses more than a few, errors are
    compared within three standard errors of the trials.
    """
    means = REFERENCES.table("mean-error")
    for cell, found in courses.items():
        driver, model, method = cell
        errors = np.array([course.error_deg for course in found])
        if method in means[driver][model]:
            allowed = max(TOLERANCE_DEG, three_errors(errors, RUNS))
            yield REFERENCES.judge("mean-error", errors.mean(), *cell, tolerance=allowed)
        elif (driver, method) != (99, "pf-asd"):  # that is among the errors of the axes
            yield REFERENCES.judge("median-error", np.median(errors), *cell)
        yield REFERENCES.judge("lost", (errors > ABOVE_DEG).mean(), *cell, runs=len(found))


MEMBERS = {
    "left eye": ("leye",),
    "right eye": ("reye",),
    "nose": ("nose",),
    "left inner corner": ("lmc",),
    "right inner corner": ("rmc",),
    "outer corners": ("llc", "rlc"),
    "brows": ("lbro", "rbro"),
    "mouth": ("lmou", "rmou"),
}


def _ratios(courses: Courses) -> Findings:
    """Judge alpha of each feature, and which features give up the head's prediction when the head turns."""
    found = courses[99, "mean", "pf-asd"]
    turned = found[0].turned
    ratios = np.mean([course.ratios for course in found], axis=0)
    frontal, away = ratios[~turned].mean(axis=0), ratios[turned].mean(axis=0)
    for name in MEMBERS:
        yield from REFERENCES.judge_all("ratio", {"frontal": _of(frontal, name), "turned": _of(away, name)}, name)
    fall = frontal - away
    lowest = sorted(FEATURES[place] for place in np.argsort(fall)[-2:])
    yield REFERENCES.judge("ratio-falls", np.sort(fall)[-2], holds=lowest == ["lmc", "rmc"])
    own = np.mean([course.ratios.mean(axis=0) for course in courses[102, "mean", "pf-asd"]], axis=0)
    yield from (REFERENCES.judge("ratio-102", _of(own, it), f"the {it}") for it in ("nose", "brows", "mouth"))


def _of(values: Floats, name: str) -> float:
    """Return the mean over the features of a name."""
    return float(values[[FEATURES.index(feature) for feature in MEMBERS[name]]].mean())


def _faster(pool: Pool) -> Findings:
    """Judge a head that is half as fast again: the head's prediction alone loses it, the mixture does not always."""
    methods: tuple[Method, ...] = ("pf-asd", "alpha-1")
    trials = tuple(Trial(method, "mean", seed) for method in methods for seed in range(FASTER_TRIALS))
    drives = pool.map(run_trials, [VideoTrials(99, trials, FASTER_FRAMES)])
    mixture, upper = ([one.error_deg for one in drives[0] if one.trial.method == method] for method in methods)
    yield REFERENCES.judge("fast-lost", min(upper))
    yield REFERENCES.judge("fast-order", np.median(mixture) / np.mean(upper))


# More people separate what depends on one face from what does not. The reference's three drivers are three draws of
# faces that we cannot repeat. If our scene and trackers are like the reference's, then the middle of many people must
# be near the middle of its three.

PEOPLE, TRIALS = range(1, 13), 2


def people(pool: Pool) -> Findings:
    """Compare medians over twelve people, two trials each."""
    trials = tuple(Trial(method, model, seed) for method in METHODS for model in MODELS for seed in range(TRIALS))
    drives = pool.map(run_trials, [VideoTrials(person, trials) for person in PEOPLE])
    errors = {(method, model): errors_of(drives, method, model) for method in METHODS for model in MODELS}
    for model in MODELS:
        ours = float(np.median(errors["pf-asd", model]))
        yield REFERENCES.judge("people-error", ours, model)
        yield REFERENCES.judge("people-order", ours / np.median(errors["alpha-0", model]), model)
    better = np.mean(errors["pf-asd", "individual"] < errors["pf-asd", "mean"])
    astray = np.mean(errors["alpha-1", "mean"] > ABOVE_DEG)
    yield REFERENCES.judge("people-own", better)
    yield REFERENCES.judge("people-lost", astray)


def errors_of(drives: Sequence[Sequence[TrialResult]], method: Method, model: Model) -> Floats:
    """Return each person's error, the mean of the trials, degrees."""
    wanted = (method, model)
    return np.array(
        [np.mean([it.error_deg for it in one if (it.trial.method, it.trial.model) == wanted]) for one in drives]
    )


# A face model that grows from the mean to the person's own has no reference: its own bar is the mean model, which it
# must beat, and the driver's own face, which it can at best come near. The people are others than those on which the
# model's noise was chosen (`pftrack.experiments.head.parameters`).

GROWTH_PEOPLE = range(300, 306)
GROWTH_MODELS: tuple[Model, ...] = ("mean", "growing", "individual")


def growth(pool: Pool) -> Findings:
    """Compare the errors of the mixture over six people, two trials each."""
    trials = tuple(Trial("pf-asd", model, seed) for model in GROWTH_MODELS for seed in range(TRIALS))
    drives = pool.map(run_trials, [VideoTrials(person, trials) for person in GROWTH_PEOPLE])
    mean, grown, own = (errors_of(drives, "pf-asd", model) for model in GROWTH_MODELS)
    by_mean, by_grown, by_own = (float(np.median(errors)) for errors in (mean, grown, own))
    ratio = by_grown / by_own
    yield REFERENCES.judge("growing", by_grown, holds=by_grown < by_mean, mean=by_mean)
    yield REFERENCES.judge("growing-near", ratio, holds=by_grown < 1.2 * by_own, own=by_own)
    yield REFERENCES.judge("growing-better", np.mean(grown < mean))
