"""Shimada 1997, chapter 4: Kalman filters of a chain, cut by bounds and with mirrored hypotheses.

Shimada shows single sequences without their numbers; sequences that show what he describes, and figures on them, are
the reference implementation's. His "one EKF" is cut by bounds. Without them the filter loses the third link
less often where a link passes the parallel to the image, since a bound that cuts the wrong side's Gaussian pulls it
further away; that is our finding, as are the rows on the unscented and the particle filter.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pftrack.core.arrays import Floats, Ints
from pftrack.core.geometry import matrix, right_jacobian
from pftrack.core.model.parameters import Value
from pftrack.core.model.source import Frame, History, Measurements, Target
from pftrack.core.numerics.matrices import solve_system
from pftrack.core.numerics.random import Purpose, Stream
from pftrack.experiments import find
from pftrack.experiments.linkage.scene import (
    FRAME_RATE_HZ,
    PLANE_SIZE_PX,
    LinkageSceneParameters,
    LinkageTarget,
    in_degrees,
)
from pftrack.filters.truncation import truncate
from pftrack.output.figures.style import CURVE_COLOURS, new_figure
from pftrack.reproduce.finding import Findings, References
from pftrack.reproduce.pool import Pool, begin, preset_recipe, recipe
from pftrack.runs.run import Run
from pftrack.vision.rendering import render_beside

if TYPE_CHECKING:
    from matplotlib.figure import Figure

REFERENCES = References(__file__)
BOUND_SDS = 3.0
"""Noise beyond it is drawn again, as in the simulated scene."""


class RunResult(NamedTuple):
    """Result of a run.

    Attributes:
        errors: (T,) greatest error of a direction, rad.
        lengths: (T, 3) estimates, px.
        deviations: (T, 3) of the same.
        low: (T, 3) lower bounds of the believed lengths, px.
        high: (T, 3) of the same.
        true_lengths: (3,) px.
        hypotheses: (T,) number of hypotheses.
        refuted: (T,) number of refuted ones.
        splits: (T,) number added by a split.
        contained: (T,) whether regions hold the truth, 1 or 0; NaN of another belief.
    """

    errors: Floats
    lengths: Floats
    deviations: Floats
    low: Floats
    high: Floats
    true_lengths: Floats
    hypotheses: Ints
    refuted: Ints
    splits: Ints
    contained: Floats

    @property
    def final(self) -> Floats:
        """The last interval of each length, (3, 2) px."""
        return np.stack([self.low[-1], self.high[-1]], axis=1)

    @property
    def worst_length_px(self) -> float:
        """The greatest error of a length at the end."""
        return float(np.abs(self.lengths[-1] - self.true_lengths).max())


def measure(run: Run) -> RunResult:
    """Carry out a run of the experiment, or of a motion of its own."""
    states = [step.state for step in run]
    rows = run.diagnostics
    return RunResult(
        np.deg2rad([row.error for row in rows if row.error is not None]),
        np.array([state.mean[-3:] for state in states]),
        np.array([state.spread[-3:] for state in states]),
        np.array([state.low[-3:] for state in states]),
        np.array([state.high[-3:] for state in states]),
        np.array(rows[0].truth[-3:] if rows[0].truth else ()),
        np.array([len(state.belief) for state in states]),
        np.array([state.events.refuted for state in states]),
        np.array([state.events.splits for state in states]),
        np.array([row.number("contained") for row in rows]),
    )


def courses(pool: Pool, tracker: str, values: Mapping[str, Value], seeds: int) -> list[RunResult]:
    """Return the results of a tracker's runs with these values, one per seed."""
    return pool.runs(measure, [recipe("linkage", tracker, values, seed=seed) for seed in range(seeds)])


def worst_length_px(found: Sequence[RunResult]) -> float:
    """Return the greatest error of a length at the end of any run."""
    return max(one.worst_length_px for one in found)


class Swing:
    """A chain in the plane with its own motion; only its points are measured, and there is no picture.

    Attributes:
        size: Width and height of the picture, px.
        frame_rate_hz: Frames a second at which it is meant to be seen.
        frame_count: Frames of the motion.
        start: The first estimate.
        noisy: The measurements depend on the seed.
    """

    size = PLANE_SIZE_PX
    frame_rate_hz = FRAME_RATE_HZ
    noisy = True

    def __init__(self, motion: "Motion", seed: int) -> None:
        """Begin the motion; the seed is that of the noise."""
        self._motion, self._seed = motion, seed
        self.frame_count: int | None = len(motion.theta)
        self.start: Target = _chain(motion.start[:3], motion.start[3:])

    def frame(self, index: int, history: History[LinkageSceneParameters]) -> Frame:
        """Return a frame; the same arguments give the same frame, to the bit."""
        del history
        target = _chain(self._motion.theta[index], self._motion.r)
        stream = Stream(self._seed, index, Purpose.SCENE)
        noise = np.asarray(stream.standard_normal(3))
        while (np.abs(noise) > BOUND_SDS).any():
            noise = np.where(np.abs(noise) > BOUND_SDS, stream.standard_normal(3), noise)
        points = np.cumsum(target.r * np.cos(np.cumsum(target.theta))) + noise
        measured = Measurements(np.column_stack([points, np.zeros(3)]), np.ones((3, 2)))
        return Frame(index, float(index), measurements=measured, target=target)


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion that the scene has not.

    Attributes:
        theta: (T, 3) joint angles, rad.
        r: (3,) lengths, px.
        start: (6,) pose and lengths at which the estimate begins, rad and px.
    """

    theta: Floats
    r: Floats
    start: Floats

    def open(self, seed: int, parameters: LinkageSceneParameters) -> Swing:
        """Return the motion as a source."""
        del parameters
        return Swing(self, seed)


def _chain(theta: Floats, r: Floats) -> LinkageTarget:
    return LinkageTarget(in_degrees(np.concatenate([theta, r])), theta=theta, r=r)


SUCCESS_RAD = 0.2
LAST = 6
"""Frames at the end over which the error of a success is averaged."""

CROSS_RUNS, QUICK_CROSS_RUNS = 30, 10


def scene(name: str) -> Mapping[str, Value]:
    """Return the values of a scene of the study."""
    values: Mapping[str, Value] = REFERENCES.settings["scenes"][name]
    return values


ROUNDS = 3
"""How often the iterated filter linearises."""


def algebra(pool: Pool, full: bool) -> Findings:
    """Truncation without observations, and the re-centring of a rotation (8.1)."""
    del pool, full
    mean, variance, found = np.array([65.0]), np.array([[100.0]]), {}
    for times in range(1, 301):
        truncate(mean, variance, (np.eye(1), np.array([60.0]), np.array([80.0])))
        found[times] = float(np.sqrt(variance[0, 0]))
    omega = np.array([0.3, -0.4, 0.2])
    jacobian, turn, exact = right_jacobian(omega), matrix(omega), _small_turn(omega)
    size = float(np.sqrt(np.square(exact).sum()))
    others = {"J_r": jacobian, "R'": turn.T, "printed R": turn}
    yield from REFERENCES.judge_all("truncated", {times: found[times] for times in REFERENCES.table("truncated")})
    yield from REFERENCES.judge_all(
        "recentred", {name: np.sqrt(np.square(other - exact).sum()) / size for name, other in others.items()}
    )


def cross(pool: Pool, full: bool) -> Findings:
    """One filter and several where the third link passes the parallel to the image (8.2)."""
    runs = CROSS_RUNS if full else QUICK_CROSS_RUNS
    for tracker, beam in (("ekf-truncated", 1), ("ekf-mirrors", 2), ("ekf-mirrors", 4)):
        errors = _last_errors(pool, tracker, {**scene("cross"), "beam_width": beam}, runs)
        title = tracker + (f", beam {beam}" if tracker == "ekf-mirrors" else "")
        share = float((errors < SUCCESS_RAD).mean())
        yield REFERENCES.judge("cross-successes", share, tracker, beam, runs=runs, title=title)
        if beam != 2:
            yield REFERENCES.judge("cross-median", np.median(errors), tracker, beam, title=title)
    for tracker in REFERENCES.table("cross-own") if full else ():  # the particles take longer than all else
        share = float((_last_errors(pool, tracker, scene("cross"), runs) < SUCCESS_RAD).mean())
        yield REFERENCES.judge("cross-own", share, tracker, runs=runs)


def static(pool: Pool, full: bool) -> Findings:
    """A pose that is held: one filter becomes sure of a wrong length of the third link (8.2)."""
    runs = 12 if full else 6
    ours = _third_length(courses(pool, "ekf-truncated", scene("static"), runs))
    worst = _third_length(courses(pool, "ukf", scene("static"), runs))[3]
    yield from REFERENCES.judge_all("static", dict(zip(REFERENCES.table("static"), ours, strict=True)))
    yield REFERENCES.judge("static-unscented", worst, holds=worst < ours[3])


def confident(pool: Pool, full: bool) -> Findings:
    """A filter that is wrong and sure of a length never takes up the mirrored link (8.5)."""
    runs = 16 if full else 8
    rates = {}
    for variance in (1, 100):
        errors = _last_errors(pool, "ekf-mirrors", {**scene("confident"), "start_length_variance_px2": variance}, runs)
        rates[variance] = float((errors < SUCCESS_RAD).mean())
    yield from REFERENCES.judge_all("confident", rates)


def recovery(pool: Pool, full: bool) -> Findings:
    """Ninety frames of small vibration, then rotation (5.7.4): the filter was to fail, and recovers (8.5)."""
    r = np.array([70.0, 60.0, 50.0])
    for title, end in (("forwards", (0.6, 0.9, 0.85)), ("through the parallel", (1.25, 0.6, 0.15))):
        found = _after_vibration(pool, end, r, r + np.array([4.0, 4.0, 8.0]), {}, 10 if full else 4)
        worst = max(float((np.abs(one.lengths[89] - r) / one.deviations[89]).max()) for one in found)
        yield REFERENCES.judge("fails", np.mean(_failed(found)), title)
        yield REFERENCES.judge("worst-before", worst, title)
    # Shorter links, taken to be longer, and mirrors near the parallel.
    r, start_px = np.array([64.0, 53.0, 42.0]), np.array([72.0, 66.0, 58.0])
    for beam, share in ((2, ".62"), (4, ".50")) if full else ():
        values: dict[str, Value] = {"mirror_tau": 0.1, "beam_width": beam}
        failed = _failed(_after_vibration(pool, (1.25, 0.6, 0.15), r, start_px, values, 8))
        yield REFERENCES.judge("short-links", np.mean(failed), beam, holds=sum(failed) >= 2, share=share)


def _after_vibration(
    pool: Pool, end: tuple[float, float, float], r: Floats, start_px: Floats, values: Mapping[str, Value], runs: int
) -> list[RunResult]:
    """Return runs of a chain that is still for 90 frames, then goes to another pose; lengths begin at others."""
    theta = _vibration(np.array([1.1, 0.9, 0.85]), np.array(end))
    motion = Motion(theta, r, np.concatenate([theta[0] + 0.03, start_px]))
    given = {
        **scene("static"),
        **dict.fromkeys(("start_length_1_px", "start_length_2_px", "start_length_3_px"), 0),
        **values,
    }
    recipes = [recipe("linkage", "ekf-mirrors", given, seed=seed) for seed in range(runs)]
    return pool.runs(measure, recipes, source=motion.open)


def _failed(found: Sequence[RunResult]) -> list[bool]:
    return [float(one.errors[-LAST:].mean()) >= SUCCESS_RAD for one in found]


def space(pool: Pool, full: bool) -> Findings:
    """The same filter in space, on a motion that shows much: the worst of all seeds (8.6)."""
    runs = 5 if full else 2
    found = courses(pool, "ekf-truncated", scene("space"), runs)
    final = worst_length_px(found)
    ratio = max(float((np.abs(one.lengths - one.true_lengths) / one.deviations)[1:].max()) for one in found)
    again = worst_length_px(courses(pool, "ekf-truncated", {**scene("space"), "linearisations": ROUNDS}, runs))
    yield REFERENCES.judge("space-final", final, "ekf-truncated")
    yield REFERENCES.judge("space-worst", ratio)
    yield REFERENCES.judge("space-iterated", again, ROUNDS, holds=again < final)
    if full:
        sampled = worst_length_px(courses(pool, "particles", scene("space"), runs))
        yield REFERENCES.judge("space-final", sampled, "particles")


def _last_errors(pool: Pool, tracker: str, values: Mapping[str, Value], runs: int) -> Floats:
    """Return the errors (runs,) at the end, rad."""
    return np.array([one.errors[-LAST:].mean() for one in courses(pool, tracker, values, runs)])


def _third_length(courses: Sequence[RunResult]) -> tuple[float, float, float, float]:
    """Return of r_3 the deviation after two observations and at the end, the final error, and the worst in sd."""
    rows = []
    for one in courses:
        off, deviations = np.abs(one.lengths[:, 2] - one.true_lengths[2]), one.deviations[:, 2]
        rows.append((deviations[2], deviations[-1], off[-1], (off / deviations).max()))
    first, last, error, worst = np.median(rows, axis=0).tolist()
    return first, last, error, worst


def _small_turn(omega: Floats) -> Floats:
    """Return by differences what small turn du (3, 3) beside R(omega) a change of omega is: R(omega + dw) = R R(du)."""
    step, columns = 1e-6, []
    for axis in np.eye(3):
        turn = solve_system(matrix(omega - step * axis), matrix(omega + step * axis))
        columns.append(
            np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (4 * step)
        )
    return np.array(columns).T


def _vibration(pose: Floats, end: Floats) -> Floats:
    """Return 150 poses (150, 3), rad: 90 that vibrate by 0.02 rad, then a way to another, eased."""
    frames = np.arange(90)[:, None]
    still = pose + 0.02 * np.sin(0.7 * frames + np.array([0.0, 1.0, 2.0]))
    weights = 0.5 - 0.5 * np.cos(np.pi * np.arange(1, 61) / 60.0)[:, None]
    return np.concatenate([still, still[-1] + weights * (end - still[-1])])


# Shimada shows no run on links that are seen as lines (1997, eqs. 4.9 to 4.11), and the reference has none, so that all
# figures are our own. Lines with root and tip say almost what four points say, since joints are where lines cross.
# Lines alone leave the root free to slide along the first link, and the tip along the last: of the lengths they show
# the middle one, and only where the links bend.

SEEDS, QUICK_SEEDS = 5, 1
QUICK_WIDER = 4.0
"""Tolerance of a single run, which is not a mean."""

FILTERS: tuple[tuple[str, Mapping[str, Value], float], ...] = (
    ("ekf-truncated", {}, 1.5),
    ("ekf-truncated", {"linearisations": ROUNDS}, 1.0),
    ("particles", {}, 1.0),
)
"""Tracker, values, and what the final error of the worst length of any seed is below, px, with lines and ends."""


def lines(pool: Pool, full: bool) -> Findings:
    """Lengths that filters find by lines with root and tip, and what regions leave of them by lines."""
    seeds = SEEDS if full else QUICK_SEEDS
    for tracker, values, limit in FILTERS if full else FILTERS[1:2]:
        found = courses(pool, tracker, {**scene("space"), **values, "links_seen_as": "lines-and-ends"}, seeds)
        title, worst = tracker + (f", linearised {ROUNDS} times" if values else ""), worst_length_px(found)
        yield REFERENCES.judge("lines-final", worst, title=title, holds=worst < limit)
    preset = preset_recipe("linkage", "3d").timeline[0].values
    for seen_as in ("lines-and-ends", "lines") if full else ("lines-and-ends",):
        way = seen_as.replace("-", " ")
        for tracker in ("ellipsoids", "box-guides") if full else ("ellipsoids",):
            found = courses(pool, tracker, {**preset, "links_seen_as": seen_as}, seeds)
            contained = np.mean([one.contained.mean() for one in found])
            yield REFERENCES.judge("lines-contained", contained, way=way, tracker=tracker)
            if tracker == "ellipsoids":
                widths = dict(enumerate(np.mean([np.diff(one.final)[:, 0] for one in found], axis=0), 1))
                wider = {} if full else {"wider": QUICK_WIDER, "ground": "chosen"}
                yield from REFERENCES.judge_all("lines-width", widths, seen_as, way=way, **wider)


SPLIT_FRAME = 68
LINK, TRUE_PX = 3, 50.0
TITLES = {"static": "EKF with bounds", "static-regions": "Guided ellipsoids"}


def split() -> NDArray[np.uint8]:
    """Return a frame in which there are two regions, with the chain from above and the lengths beside it (RGB)."""
    run = begin(preset_recipe("linkage", "mirror3"))
    step = run.seek(SPLIT_FRAME)
    return render_beside(find("linkage").draw(step, run.diagnostics), scale=2.0)


def still() -> "Figure":
    """Return the intervals of the third length by a filter and by regions, on the same frames."""
    figure, (panel,) = new_figure(2.8)
    for (preset, title), colour in zip(TITLES.items(), (CURVE_COLOURS[1], CURVE_COLOURS[0]), strict=True):
        run = begin(preset_recipe("linkage", preset))
        run.finish()
        ends = np.array([row.vector(f"length_{LINK}") for row in run.diagnostics], dtype=np.float64)
        panel.fill_between(np.arange(len(ends)), *ends.T, color=colour, alpha=0.35, label=title)
    panel.axhline(TRUE_PX, color="black", linewidth=1.0, linestyle="--", label="truth")
    panel.set_xlim(0, len(ends) - 1)
    panel.set_ylim(35, 65)
    panel.set_xlabel("Frame")
    panel.set_ylabel("Length of link 3, px")
    panel.legend(loc="upper right", frameon=False, ncols=3)
    return figure
