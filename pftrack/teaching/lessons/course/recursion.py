"""Lesson 5: predict, correct, repeat."""

import math

import numpy as np

from pftrack.core.arrays import Floats
from pftrack.core.model.recipe import Change, Recipe
from pftrack.core.numerics.matrices import solve_system
from pftrack.teaching.lessons.course.densities import ceiling, normal
from pftrack.teaching.lessons.course.rounds import (
    GRID,
    MEASURED,
    PRIOR_VARIANCE,
    Moment,
    RecursionParameters,
    moments,
    spread,
)
from pftrack.teaching.lessons.figure import Axis, Curve, Figure, Panel, Scatter, StripChart, Trace
from pftrack.teaching.lessons.lesson import (
    Answer,
    Check,
    Demonstration,
    Lesson,
    Mistake,
    Number,
    Outcome,
    Question,
    Scenario,
    Shown,
)

_CHECKED: Floats = np.arange(-40.0, 40.0, 0.05)
"""Positions on which the checks are made, m."""


def show(parameters: RecursionParameters, seed: int) -> Shown:
    """Show the density before and after the last step, and how the variance went up and down."""
    del seed
    past = list(moments(GRID, parameters))
    last = past[-1]
    mean, variance = spread(GRID, last.density)
    any_step = len(past) > 1
    numbers = (
        Number("Variance now, on the grid", variance, last.variance, 1e-4, "m²", reveals=any_step),
        Number("Mean now, on the grid", mean, float(last.exact.mean[0]), 1e-4, "m", digits=3, reveals=any_step),
        Number(
            "Variance that it settles at, measured in every step", _steady_variance(parameters), unit="m²", digits=3
        ),
    )
    return Shown(Figure(panels=(_density_panel(past, parameters.noise), _variance_panel(past))), numbers)


def _steady_variance(parameters: RecursionParameters) -> float:
    """Return the variance after a measurement that the next round comes back to."""
    motion, noise = parameters.motion, parameters.noise
    return 0.5 * (math.sqrt(motion**2 + 4.0 * motion * noise) - motion)


def _density_panel(past: list[Moment], noise: float) -> Panel:
    last, seen = past[-1], np.abs(GRID) <= 12.0
    places, exact = GRID[seen], normal(GRID, float(last.exact.mean[0]), math.sqrt(last.variance))
    traces: list[Curve] = []
    words = "The prior: the target is about 0 m, with a variance of 9 m²."
    if len(past) > 1:
        before = past[-2]
        name = "predicted" if before.step == "p" else "known" if before.step else "prior"
        traces.append(Curve(title=f"before: {name}", ink="prediction", x=places, y=before.density[seen], dashed=True))
        words = f"Before the last step: mean {before.exact.mean[0]:.2f} m, variance {before.variance:.2f} m². The last "
        words += "step is a prediction." if last.step == "p" else "step brings no measurement."
    if last.measurement is not None:
        title = f"likelihood of the measurement {last.measurement:g} m"
        likelihood = normal(places, last.measurement, math.sqrt(noise))
        traces.append(Curve(title=title, ink="observation", x=places, y=likelihood))
        words = words.replace("brings no measurement", f"is a measurement of {last.measurement:g} m")
    highest = max(float(np.max(trace.y)) for trace in traces) if traces else 0.0
    after = len(past) > 1
    when = "after" if after else "prior"
    traces += [
        Curve(title=f"{when}, exact", ink="truth", x=places, y=exact[seen], reveals=after),
        Curve(title=f"{when}, on the grid", ink="estimate", x=places, y=last.density[seen], dashed=True,
              area=(-12.0, 12.0), reveals=after),
    ]  # fmt: skip
    return Panel(
        id="density",
        title="Where the target may be",
        x=Axis(title="position x", low=-12.0, high=12.0, unit="m"),
        y=Axis(title="density", low=0.0, high=ceiling(1.05 * max(highest, float(exact.max()))), unit="per m"),
        traces=tuple(traces),
        words=words,
        share=(1.3, 1.0),
    )


def _variance_panel(past: list[Moment]) -> Panel:
    variances = np.array([moment.variance for moment in past])
    on_grid = np.array([spread(GRID, moment.density)[1] for moment in past])
    steps, last = np.arange(len(past)), max(len(past) - 1, 1)
    dots: list[Trace] = []
    for title, ink, chosen in (
        ("after a prediction", "prediction", [moment.step == "p" for moment in past]),
        ("after a measurement", "observation", [moment.measurement is not None for moment in past]),
    ):
        at = steps[np.array(chosen)]
        known, newest = at[at < last], at[at == last]
        if len(known):
            dots.append(Scatter(title=title, ink=ink, x=known, y=on_grid[known], size_px=8.0))
        if len(newest):
            named = "" if len(known) else title
            dots.append(Scatter(title=named, ink=ink, x=newest, y=on_grid[newest], size_px=8.0, reveals=True))
    recent = ", ".join(f"{variance:.2f}" for variance in variances[:last][-6:])
    return Panel(
        id="variance",
        title="Variance after each step",
        x=Axis(title="step", low=0.0, high=max(10.0, float(last))),
        y=Axis(title="variance", low=0.0, high=ceiling(1.05 * float(variances.max())), unit="m²"),
        traces=(
            Curve(title="exact", ink="truth", x=steps[:last], y=variances[:last]),
            StripChart(title="on the grid", ink="estimate", x=steps[:last], y=on_grid[:last]),
            Curve(ink="truth", x=steps[last - 1 :], y=variances[last - 1 :], reveals=True),
            StripChart(ink="estimate", x=steps[last - 1 :], y=on_grid[last - 1 :], reveals=True),
            *dots,
        ),
        words=f"A line that rises with predictions and falls with measurements. Before the last step: {recent} m².",
        row=1,
    )


def _answer(parameters: RecursionParameters, seed: int) -> Answer:
    del seed
    *_, before, after = moments(GRID, parameters)
    words = f"1/{before.variance:.3g} + 1/{parameters.noise:g} is 1/{after.variance:.3g}."
    return Answer(after.variance, spread(GRID, after.density)[1], words)


def _reference() -> list[Moment]:
    """Return the eight rounds that the lesson shows."""
    return list(moments(_CHECKED, RecursionParameters(rounds=len(MEASURED))))


def _added_information() -> Outcome:
    past = _reference()
    variances = [spread(_CHECKED, moment.density)[1] for moment in past]
    rises = [variances[number] - variances[number - 1] for number in range(1, len(past)) if past[number].step == "p"]
    return Outcome(max(rises, key=lambda rise: abs(rise - 1.0)), 1.0, 1e-4)


def _densities() -> Outcome:
    apart = [
        np.abs(it.density - normal(_CHECKED, float(it.exact.mean[0]), math.sqrt(it.variance))).max()
        for it in _reference()
    ]
    return Outcome(float(max(apart)), 0.0, 1e-6)


def _moments() -> Outcome:
    apart = [np.subtract(spread(_CHECKED, it.density), (it.exact.mean[0], it.variance)) for it in _reference()]
    return Outcome(float(np.abs(apart).max()), 0.0, 1e-6)


def _sequential() -> float:
    return float(_reference()[-1].exact.mean[0])


def _batch() -> float:
    """Return the mean of the last position given all measurements at once, from their joint Gaussian."""
    rounds = np.arange(1, len(MEASURED) + 1)
    covariance = PRIOR_VARIANCE + np.minimum.outer(rounds, rounds) + 2.0 * np.eye(len(rounds))
    return float((PRIOR_VARIANCE + rounds) @ solve_system(covariance, np.array(MEASURED)))


LESSON = Lesson(
    id="recursion",
    number=5,
    title="Predict, correct, repeat",
    idea=(
        "The target moves, so what was known becomes the prior of the next step after the motion model has shifted and "
        "blurred it: **predict**. A new measurement sharpens it: **correct**. Of a target that drifts either way, the "
        "variance $\\sigma^2$ goes\n\n"
        r"$$\text{predict: } \sigma^2 \to \sigma^2 + q$$"
        "\n\n"
        r"$$\text{correct: } \frac{1}{\sigma^2} \to \frac{1}{\sigma^2} + \frac{1}{r}$$"
        "\n\nThe past is needed no more: the last density holds all of it, if motion and measurement depend on "
        "nothing but the present state. Repeating these two steps is the whole of tracking."
    ),
    body=Demonstration(RecursionParameters(), show),
    notice="Predictions widen the density by the same amount each; a measurement narrows a wide one most.",
    tries=(
        "Set the predictions after the rounds to 10, then the measurements to 1: most of the harm is undone at once.",
        "Set q to 0: the target stands still, and each measurement makes the variance smaller for good.",
        "Switch on “No measurement”: the target is hidden, and only the blurring is left.",
    ),
    question=Question(
        text=(
            "The variance has settled at 1 m². Ten predictions with q = 1 raise it to 11 m². What is it after one "
            "measurement with r = 2?"
        ),
        kind="number",
        answer=_answer,
        tolerance=0.2,
        unit="m²",
        bounds=(0.0, 100.0),
        at={"rounds": 4, "predictions": 10, "measurements": 1},
        words=(
            "What adds up is the inverse of the variance, how sure one is. After a measurement one is always surer "
            "than the measurement alone would make one, so that the variance is below r, however long it grew."
        ),
        mistakes=(
            Mistake(2.0, "That is the measurement alone. What was known before is vague, but it still helps a little."),
            Mistake(1.0, "One measurement undoes much, not all: the settled value takes a few rounds more."),
            Mistake(6.5, "That is halfway between 11 and 2. Two sources together are surer than either, not between."),
            Mistake(9.0, "That is 11 - 2: a noisier measurement would then help more."),
            Mistake(10.0, "A measurement does not take back one prediction; it does more, the less one knew."),
            Mistake(13.0, "That is 11 + 2. Variances add up in a prediction; a measurement makes one surer."),
        ),
    ),
    checks=(
        Check("predict-adds", "Each prediction on the grid adds q to the variance.", _added_information),
        Check("grid-densities", "Grid and Kalman filter have the same density after every step.", _densities),
        Check("grid-moments", "Grid and Kalman filter have the same mean and variance after every step.", _moments),
        Check("one-by-one", "Step by step or all at once, the mean is the same.",
              lambda: Outcome(_sequential(), _batch(), 1e-9)),
        Check("reference", "After the eight measurements the mean is 4.34281 m.",
              lambda: Outcome(_sequential(), 4.34281, 5e-6)),
    ),
    uses=(
        Scenario(
            Recipe(experiment="sine", tracker="kalman", timeline=(Change(0, {"waveform": "sine", "initial_sd": 1.0}),)),
            unlocked=("process_noise_sd", "assumed_noise_sd", "observation_noise_sd"),
            words="A Kalman filter on a sine: the first measurement takes sigma from 1 to 0.1, the next fourteen to "
            "0.05.",
        ),
        Scenario(
            Recipe(experiment="trajectories", tracker="lg", timeline=(Change(0, {"trajectories_scene": "tracks"}),)),
            unlocked=("noise_variance_px2", "drive_variance_px2"),
            frame=45,
            words=(
                "The linear Gaussian filter on tracks: at frame 45 a measurement is 38 px off, and the correction "
                "goes along with it by 26 px."
            ),
        ),
    ),
)  # fmt: skip
