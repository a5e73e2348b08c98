"""The driver's head: Bando 2007, ch. 4 section 4, on a simulated head (docs/methods/heads.md).

Eleven templates in two layers, three drivers, with the mean of other people as the face model or the driver's own face.
What Bando says: the adaptive mixture is clearly best; the features' own prediction alone loses features whose
look changes; the head's prediction alone fails when its assumptions break; the driver's own face gives more successes
at small thresholds.

How hard a driver is hangs on the face: on how far it is from the mean, and on what it hides when it turns. Of
the reference's drivers the seeds are known and not the order of the draws, so ours are other people. Driver 99 comes
out alike. Our 101 has a nose 8 mm shorter than the mean, so steep that it hides the inner corners of the eyes when the
head turns. Our 102 has one 6 mm longer and 4 mm flatter, and the nose is most of what tells a nod from a change of
scale: with the own nose alone in the mean model the error of the pitch falls from 6.7 to 2.3 degrees. So
`head_people` compares medians over people too, which do not hang on a single face.

The head's prediction alone is lost at once or not at all, by how fast the head is and how well the model fits. With
driver 99 that happens between 1.25 and 1.5 times Bando's speed here, and at Bando's speed there.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.experiments.shared.pose.methods import Method
from pftrack.output.figures.picture import save
from pftrack.output.figures.style import (
    CURVE_COLOURS,
    INK,
    TITLE_PT,
    explain_below,
    new_figure,
    write_heading,
    write_title,
)
from pftrack.reproduce.finding import (
    CHOSEN,
    FEWER,
    PROTOCOL,
    TRIALS,
    Finding,
    Unexplained,
    claim,
    compare,
    share,
    three_errors,
)
from pftrack.reproduce.head.trials import (
    Model,
    Trial,
    TrialResult,
    VideoTrials,
    distance_mm,
    growth,
    people,
    run_trials,
)
from pftrack.reproduce.head.turns import turns
from pftrack.reproduce.pool import Pool
from pftrack.vision.geometry.face import FEATURES, TITLES

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Of a success curve, the share of trials whose error on an axis is below a threshold (fig. 4.16), it is the *place*
# that is compared: by how much the curve has to be moved along the thresholds to agree with the reference at all
# thresholds that are known. A curve is steep: all trials of a method see the same video, and their errors lie within a
# few tenths of a degree. A rate at one threshold therefore says little about another renderer.

CURVE_SOURCE = "Bando 2007, ch. 4 fig. 4.16; reference implementation"

CURVE_AXES = ("pitch", "yaw", "roll")
THRESHOLDS_DEG = (0.5, 1.5, 2.0, 2.5, 3.0)
RATES: dict[Model, tuple[tuple[float, ...], ...]] = {
    "mean": ((0.0, 0.0, 0.95, 1.0, 1.0), (0.0, 0.0, 0.0, 0.5, 0.85), (1.0, 1.0, 1.0, 1.0, 1.0)),
    "individual": ((0.0, 0.85, 1.0, 1.0, 1.0), (0.0, 0.0, 1.0, 1.0, 1.0), (0.95, 1.0, 1.0, 1.0, 1.0)),
}
"""Of driver 99 with the mixture, by axis and threshold."""

SLACK = 0.1
"""Two trials of twenty may be on the other side of a threshold."""

FARTHEST_DEG, STEP_DEG = 3.0, 0.01
CURVE_TOLERANCE_DEG = 0.7
"""0.4 of the mean over three axes, times their root."""

GAIN_AT = {"pitch": 1.5, "yaw": 2.0}
"""Thresholds in degrees at which the reference's own face succeeds and the mean model does not."""


def success_rates(courses: Sequence[TrialResult], axis: int, thresholds_deg: Floats) -> Floats:
    """Return the share of trials whose mean absolute error on an axis is below each threshold, (n,)."""
    errors = np.array([course.errors_deg[axis] for course in courses])
    rates: Floats = (errors < thresholds_deg[:, None]).mean(axis=1)
    return rates


def curves(by_model: dict[Model, list[TrialResult]]) -> list[Finding]:
    """Compare the curves of driver 99, tracked by the mixture, given the trials by face model."""
    findings = []
    for model, references in RATES.items():
        for axis, name in enumerate(CURVE_AXES):
            moved = _distance_deg(by_model[model], axis, np.array(references[axis]))
            result = f"head: success curve of {name}, {model} model, by how much it lies elsewhere, degrees"
            findings.append(compare(result, moved, 0.0, CURVE_TOLERANCE_DEG, CURVE_SOURCE, ground=CHOSEN))
    for name, threshold in GAIN_AT.items():
        axis, at = CURVE_AXES.index(name), np.array([threshold])
        own, other = (success_rates(by_model[model], axis, at)[0] for model in ("individual", "mean"))
        result = f"head: success within {threshold} degrees of {name}: the own face succeeds more often (gain)"
        findings.append(claim(result, float(own - other), holds=own > other, source=CURVE_SOURCE))
    return findings


def _distance_deg(courses: Sequence[TrialResult], axis: int, references: Floats) -> float:
    """Return by how little a curve has to be moved, to one side or the other, to meet the reference."""
    thresholds = np.array(THRESHOLDS_DEG)
    for moved in np.arange(0.0, FARTHEST_DEG, STEP_DEG):
        low = success_rates(courses, axis, thresholds - moved)
        high = success_rates(courses, axis, thresholds + moved)
        if (low - SLACK <= references).all() and (references <= high + SLACK).all():
            return float(moved)
    return float("nan")


MODEL_COLOURS: dict[Model, str] = {"individual": CURVE_COLOURS[0], "mean": CURVE_COLOURS[1]}
NAMES: dict[Model, str] = {"individual": "the driver's own face", "mean": "mean face of other people"}
MOST_DEG = 4.0
HIDDEN: dict[str, Any] = {"color": INK["hidden"], "alpha": 0.2, "linewidth": 0}


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
    figure, panels = new_figure(6.0, rows=4, columns=3, share="xy")
    for panel, name, values in zip(panels, FEATURES, ratios.T, strict=False):
        panel.fill_between(frames, 0.0, 1.0, where=courses[0].turned, **HIDDEN)
        panel.plot(frames, values, color=MODEL_COLOURS["individual"], linewidth=0.8)
        write_title(panel, TITLES[name].capitalize())
    panels[11].set_visible(False)
    panels[8].tick_params(labelbottom=True)
    figure.supxlabel("Frame", fontsize=TITLE_PT)
    figure.supylabel("alpha, share of the head's prediction", fontsize=TITLE_PT)
    write_heading(figure, "Alpha of each feature; shaded where the head is turned by more than 20°")
    return figure


def success_by_threshold(by_model: dict[Model, list[TrialResult]]) -> "Figure":
    """Draw the success of each axis over the threshold, of both face models."""
    thresholds = np.linspace(0.0, MOST_DEG, 401)
    figure, panels = new_figure(3.2, columns=len(CURVE_AXES), share="y")
    for axis, (panel, name) in enumerate(zip(panels, CURVE_AXES, strict=True)):
        for model, colour in MODEL_COLOURS.items():
            rates = success_rates(by_model[model], axis, thresholds)
            panel.plot(thresholds, rates, color=colour, linewidth=1.5, label=NAMES[model])
        write_title(panel, name.capitalize())
        panel.set_xlabel("Threshold of the mean error, °")
    panels[0].set_ylabel("Success rate")
    panels[0].set_ylim(-0.02, 1.02)
    explain_below(figure, panels[0], 2)
    write_heading(figure, f"Trials below a threshold, PF-ASD, {len(by_model['mean'])} trials")
    return figure


SOURCE = "Bando 2007, ch. 4 section 4; reference implementation"
OTHER_FACE = "our driver is another person, of whose face the model tells more or less than of the reference's"
LOST = "how far a head that is lost goes is a matter of the face: our driver is another person"
SOURCE_SPEED = "reference implementation"
SOURCE_FACES = "reference implementation"

METHODS: tuple[Method, ...] = ("pf-asd", "alpha-1", "alpha-0")
MODELS: tuple[Model, ...] = ("mean", "individual")
RUNS = 20
TOLERANCE_DEG = 0.4
QUICK_AXIS_TOLERANCE_DEG = 0.7
"""Of one axis in two trials."""

OTHER_YAW = Unexplained("the yaw of our driver 99 is less off than the reference's; the cause is not known")

ABOVE_DEG = 3.0
FASTER_FRAMES, FASTER_TRIALS = 600, 5
"""Bando's script is given 900 frames; with 600 the head's prediction alone is always lost."""

DISTANCES_MM = {99: 2.2, 101: 3.9, 102: 3.6}
TABLE: dict[tuple[int, Model], dict[Method, tuple[float, int]]] = {
    (99, "mean"): {"pf-asd": (1.64, 0), "alpha-1": (13.1, 14), "alpha-0": (4.50, 11)},
    (101, "mean"): {"pf-asd": (2.92, 3), "alpha-1": (22.8, 20), "alpha-0": (6.32, 20)},
    (102, "mean"): {"pf-asd": (2.12, 0), "alpha-1": (37.0, 20), "alpha-0": (8.38, 19)},
    (99, "individual"): {"pf-asd": (1.27, 0), "alpha-1": (1.19, 0), "alpha-0": (4.12, 11)},
    (101, "individual"): {"pf-asd": (1.80, 0), "alpha-1": (1.69, 0), "alpha-0": (12.1, 20)},
    (102, "individual"): {"pf-asd": (1.39, 1), "alpha-1": (12.1, 12), "alpha-0": (8.35, 19)},
}
"""Error, degrees, and how many of 20 trials are above 3 degrees. The error of driver 102 with the own face and the
mixture is the median: its mean, 1.80, is that of one lost trial."""

AXES: dict[Model, tuple[tuple[float, float, float], float]] = {
    "mean": ((1.91, 2.61, 0.40), 2.8),
    "individual": ((1.49, 1.86, 0.46), 2.2),
}
"""Of driver 99 with the mixture: errors of pitch, yaw and roll, degrees, and of the features, px."""

RATIOS: dict[str, tuple[tuple[str, ...], float, float]] = {
    "left eye": (("leye",), 0.90, 0.88),
    "right eye": (("reye",), 0.88, 0.84),
    "nose": (("nose",), 0.88, 0.74),
    "left inner corner": (("lmc",), 0.83, 0.61),
    "right inner corner": (("rmc",), 0.81, 0.58),
    "outer corners": (("llc", "rlc"), 0.88, 0.79),
    "brows": (("lbro", "rbro"), 0.88, 0.82),
    "mouth": (("lmou", "rmou"), 0.89, 0.84),
}
"""alpha of driver 99 with the mean model, by whether the head is frontal or turned."""

RATIO_TOLERANCE = 0.12
LOWER_102 = {"the nose": ("nose",), "the brows": ("lbro", "rbro"), "the mouth": ("lmou", "rmou")}
"""Features that the reference follows by their own prediction, alpha 0.1 to 0.3, where the mean model is poor."""

FEW = 3
"""Trials of a reference above 3 degrees, up to which its error is not that of lost trials."""

OTHERWISE: frozenset[tuple[int, Model, Method]] = frozenset(
    {
        (99, "mean", "alpha-1"),
        (101, "mean", "pf-asd"),
        (101, "individual", "pf-asd"),
        (101, "individual", "alpha-1"),
        (102, "mean", "pf-asd"),
        (102, "individual", "alpha-1"),
        (102, "individual", "alpha-0"),
    }
)
"""Cells that come out otherwise, since our driver is another person."""

ERRORS_OTHERWISE: frozenset[tuple[int, Model, Method]] = frozenset(
    {
        (99, "mean", "alpha-1"),
        (101, "mean", "alpha-1"),
        (101, "mean", "alpha-0"),
        (101, "individual", "alpha-0"),
        (102, "individual", "alpha-1"),
        (102, "individual", "alpha-0"),
    }
)
"""Cells in which the error is mainly that of lost trials, and otherwise for the same reason."""

NOT_LOST = frozenset({(99, "alpha-1")})
"""Drivers whom the head's prediction alone does not lose here."""


Courses = dict[tuple[int, Model, Method], list[TrialResult]]


def pose(pool: Pool, full: bool) -> list[Finding]:
    """Errors of three methods on three drivers with two face models, their ratios and success curves."""
    courses = _courses(pool, full)
    findings = [
        compare(
            f"head: driver {driver}, distance from the mean face, mm",
            distance_mm(driver),
            wanted,
            0.2,
            SOURCE_FACES,
            ground=CHOSEN,
        )
        for driver, wanted in DISTANCES_MM.items()
    ]
    findings += _axes(courses, full=full)
    for driver in DISTANCES_MM if full else (99,):
        findings += _orders(courses, driver)
    if not full:
        return findings
    first = {model: courses[99, model, "pf-asd"] for model in MODELS}
    if pool.folder is not None:
        for name, figure in draw(first).items():
            save(figure, pool.folder / f"{name}.png", name)
    return [
        *findings,
        *_table(courses),
        *_ratios(courses),
        *curves(first),
        *_faster(pool),
        *people(pool),
        *growth(pool),
        *turns(pool),
    ]


def _courses(pool: Pool, full: bool) -> Courses:
    if full:
        work = [
            VideoTrials(driver, tuple(Trial(method, model, seed) for method in METHODS for seed in range(RUNS)))
            for driver, model in TABLE
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


def _axes(courses: Courses, *, full: bool) -> list[Finding]:
    allowed, ground = (TOLERANCE_DEG, PROTOCOL) if full else (QUICK_AXIS_TOLERANCE_DEG, FEWER)
    findings = []
    for model, (angles, feature_px) in AXES.items():
        found = courses[99, model, "pf-asd"]
        name = f"head: driver 99, {model} model, pf-asd"
        findings.append(
            compare(
                f"{name}, error, degrees",
                _mean(found, _error),
                TABLE[99, model]["pf-asd"][0],
                TOLERANCE_DEG,
                SOURCE,
                ground=PROTOCOL,
            )
        )
        ours = np.mean([course.errors_deg for course in found], axis=0)
        for axis, error, wanted in zip(("pitch", "yaw", "roll"), ours, angles, strict=True):
            result, known = f"{name}, {axis}, degrees", OTHER_YAW if axis == "yaw" else ""
            findings.append(compare(result, float(error), wanted, allowed, SOURCE, ground=ground, known=known))
        ours = _mean(found, lambda course: course.feature_px)
        findings.append(compare(f"{name}, features, px", ours, feature_px, 0.4, SOURCE, ground=CHOSEN))
    return findings


def _orders(courses: Courses, driver: int) -> list[Finding]:
    """Judge what the reference asserts of every driver, as far as the methods have been run."""
    own, other = courses[driver, "individual", "pf-asd"], courses[driver, "mean", "pf-asd"]
    median = float(np.median([_error(course) for course in other]))
    findings = []
    limits: tuple[tuple[Method, float], ...] = (("alpha-0", 0.6), ("alpha-1", 0.3))
    for method, limit in limits:
        if (driver, "mean", method) in courses:
            ratio = median / _mean(courses[driver, "mean", method], _error)
            findings.append(
                claim(
                    f"head: driver {driver}, mean model: median of pf-asd over mean of {method} (below {limit})",
                    ratio,
                    holds=ratio < limit,
                    source=SOURCE,
                    known=OTHER_FACE if (driver, method) in NOT_LOST else "",
                )
            )
    astray = float(np.mean([_error(course) > 2.0 * median for course in other]))
    result = f"head: driver {driver}, mean model: share of pf-asd trials above twice the median (at most 0.1)"
    findings.append(claim(result, astray, holds=astray <= 0.1, source=SOURCE))
    gain = _mean(other, _error) - _mean(own, _error)
    result = f"head: driver {driver}: the own face beats the mean model (gain, degrees)"
    return [*findings, claim(result, gain, holds=gain > 0.0, source=SOURCE)]


def _table(courses: Courses) -> list[Finding]:
    """Judge the error and how many trials are lost, in every cell.

    The tolerance that is stated is for trials that are not lost. Where the reference loses more than a few, errors are
    compared within three standard errors of the trials.
    """
    findings = []
    for (driver, model), references in TABLE.items():
        for method, (error, above) in references.items():
            found, cell = courses[driver, model, method], (driver, model, method)
            errors = np.array([_error(course) for course in found])
            name = f"head: driver {driver}, {model} model, {method}"
            if above > FEW:
                result, ours, known = f"{name}, mean error, degrees", _mean(found, _error), ERRORS_OTHERWISE
                allowed, ground = max(TOLERANCE_DEG, three_errors(errors, RUNS)), TRIALS
                because = LOST
            else:
                result, ours, known = f"{name}, median error, degrees", float(np.median(errors)), OTHERWISE
                allowed, ground = TOLERANCE_DEG, PROTOCOL
                because = OTHER_FACE
            if (driver, method) != (99, "pf-asd"):  # that is among the errors of the axes
                expected = because if cell in known else ""
                findings.append(compare(result, ours, error, allowed, SOURCE, known=expected, ground=ground))
            count, result = int((errors > ABOVE_DEG).sum()), f"{name}, share of trials above 3 degrees"
            expected = OTHER_FACE if cell in OTHERWISE else ""
            findings.append(share(result, count, len(found), above / RUNS, RUNS, SOURCE, known=expected))
    return findings


def _ratios(courses: Courses) -> list[Finding]:
    """Judge alpha of each feature, and which features give up the head's prediction when the head turns."""
    found = courses[99, "mean", "pf-asd"]
    turned = found[0].turned
    ratios = np.mean([course.ratios for course in found], axis=0)
    by_view = {"frontal": ratios[~turned].mean(axis=0), "turned": ratios[turned].mean(axis=0)}
    findings = []
    for name, (features, *references) in RATIOS.items():
        members = [FEATURES.index(feature) for feature in features]
        for (view, means), reference in zip(by_view.items(), references, strict=True):
            result = f"head: driver 99, mean model, alpha of the {name}, {view}"
            findings.append(
                compare(result, float(means[members].mean()), reference, RATIO_TOLERANCE, SOURCE, ground=CHOSEN)
            )
    fall = by_view["frontal"] - by_view["turned"]
    lowest = sorted(FEATURES[place] for place in np.argsort(fall)[-2:])
    result = "head: driver 99: the inner corners of the eyes give up the head's prediction most (fall of alpha)"
    findings.append(claim(result, float(np.sort(fall)[-2]), holds=lowest == ["lmc", "rmc"], source=SOURCE))
    own = np.mean([course.ratios.mean(axis=0) for course in courses[102, "mean", "pf-asd"]], axis=0)
    for name, features in LOWER_102.items():
        ours = float(np.mean([own[FEATURES.index(feature)] for feature in features]))
        result = f"head: driver 102, mean model, alpha of {name}"
        known = OTHER_FACE if name == "the mouth" else ""
        findings.append(compare(result, ours, 0.2, 0.1, SOURCE, ground=PROTOCOL, known=known))
    return findings


def _faster(pool: Pool) -> list[Finding]:
    """Judge a head that is half as fast again: the head's prediction alone loses it, the mixture does not always."""
    methods: tuple[Method, ...] = ("pf-asd", "alpha-1")
    trials = tuple(Trial(method, "mean", seed) for method in methods for seed in range(FASTER_TRIALS))
    (found,) = pool.map(run_trials, [VideoTrials(99, trials, FASTER_FRAMES)])
    upper = [_error(course) for course in found if course.trial.method == "alpha-1"]
    mixture = [_error(course) for course in found if course.trial.method == "pf-asd"]
    ratio = float(np.median(mixture) / np.mean(upper))
    return [
        claim(
            "head: driver 99, mean model, 600 frames: least error of alpha-1, degrees (above 3)",
            min(upper),
            holds=min(upper) > ABOVE_DEG,
            source=SOURCE_SPEED,
        ),
        claim(
            "head: driver 99, mean model, 600 frames: median of pf-asd over mean of alpha-1 (below 0.3)",
            ratio,
            holds=ratio < 0.3,
            source=SOURCE_SPEED,
        ),
    ]


def _mean(courses: list[TrialResult], of: Callable[[TrialResult], float]) -> float:
    return float(np.mean([of(course) for course in courses]))


def _error(course: TrialResult) -> float:
    return course.error_deg
