"""One step of a bootstrap filter: pftrack and other libraries on the same model and data in one run.

The model: positions and velocities in the plane (4 dimensions), an acceleration drawn anew in every step, measured
position. Each library is used as its documentation shows: systematic resampling in every step, the posterior mean as
estimate. FilterPy has no particle filter, only resampling; its users write the rest in NumPy. `particles` is measured
twice: with its own distributions, and as a Feynman-Kac class of the same NumPy expressions, which is faster.

All run on one core, in turns of a few steps, so that a disturbance affects all of them. A library counts only if its
results are right: `off` is the distance of its estimates from the exact ones of the Kalman filter, in posterior
standard deviations. It falls as 1 / sqrt(N) and is nearly the same for all, since all run the same algorithm.
"""

from _table import Size, arguments, progress, report, single_threaded

single_threaded()

from collections.abc import Callable, Iterator  # noqa: E402
from datetime import datetime, timedelta  # noqa: E402
from functools import partial  # noqa: E402
from statistics import median  # noqa: E402
from time import perf_counter  # noqa: E402

import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from pftrack.core.numerics.random import (  # noqa: E402
    Gaussian,
    Purpose,
    Stream,
)
from pftrack.filters import bootstrap, kalman  # noqa: E402
from pftrack.filters.dynamics import constant_velocity  # noqa: E402
from pftrack.filters.particles import ParticleSet  # noqa: E402

Array = NDArray[np.float64]
Step = Callable[[int], Array]  # measurement number -> estimate

COUNTS = (100, 1_000, 10_000)
INTERVAL = 1.0
TURN = 20
DYNAMICS = constant_velocity(2, INTERVAL, acceleration_sd=0.3)
TRANSITION, NOISE = DYNAMICS.transition, DYNAMICS.noise  # x' = A x + B u, with u in the plane
OBSERVATION = np.eye(2, 4)
SIGMA = 1.0
RIGHT = 8.0  # posterior standard deviations times sqrt(N); a wrong model is off by more at N = 10,000
START = Gaussian(np.array([0.0, 0.0, 1.0, 0.5]), np.diag([1.0, 1.0, 0.1, 0.1]))
CLOCK = datetime(2000, 1, 1)  # noqa: DTZ001 - Stone Soup's example has no zone either


def data(steps: int) -> tuple[Array, Array, Array]:
    """Return measurements (steps, 2), and the exact posterior means (steps, 4) and variances (steps, 4)."""
    rng = np.random.default_rng(1)
    state = START.sample(rng, 1)[0]
    posterior = START
    measured, means, variances = [], [], []
    for _ in range(steps):
        state = TRANSITION @ state + NOISE @ rng.standard_normal(2)
        measurement = state[:2] + SIGMA * rng.standard_normal(2)
        prior = kalman.predict(posterior, DYNAMICS)
        posterior, _ = kalman.update(prior, measurement, OBSERVATION, SIGMA**2 * np.eye(2))
        measured.append(measurement)
        means.append(posterior.mean)
        variances.append(np.diag(posterior.covariance))
    return np.array(measured), np.array(means), np.array(variances)


def log_likelihood(states: Array, measurement: Array) -> Array:
    """Return log p(z | x) up to a constant, (N,), in the form used for every library that lets the user choose it."""
    u, v = states[:, 0] - measurement[0], states[:, 1] - measurement[1]
    result: Array = (-0.5 / SIGMA**2) * (u * u + v * v)
    return result


def ours(count: int, measured: Array) -> Step:
    """Build pftrack's step, with a new generator in every frame, as in a run."""
    particles = ParticleSet.uniform(START.sample(np.random.default_rng(2), count))

    def step(t: int) -> Array:
        nonlocal particles
        rng = Stream(0, t, Purpose.TRACK)
        weigh = partial(log_likelihood, measurement=measured[t])
        particles = bootstrap.step(particles, DYNAMICS, weigh, rng).particles
        mean: Array = particles.weights @ particles.states
        return mean

    return step


def with_particles(count: int, measured: Array) -> Step:
    """Build the step of `particles`."""
    import particles as library

    rng = np.random.default_rng(2)

    class ConstantVelocity(library.FeynmanKac):  # type: ignore[misc]
        def M0(self, N):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802, N803 - the library's names
            return self.M(0, START.sample(rng, N))

        def M(self, _t, xp):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return xp @ TRANSITION.T + rng.standard_normal((len(xp), 2)) @ NOISE.T

        def logG(self, t, _xp, x):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return log_likelihood(x, measured[t])

    fk = ConstantVelocity(len(measured))
    smc = library.SMC(fk=fk, N=count, resampling="systematic", ESSrmin=1.0, collect="off")

    def step(_t: int) -> Array:
        next(smc)
        mean: Array = smc.W @ smc.X
        return mean

    return step


def with_particles_distributions(count: int, measured: Array) -> Step:
    """Build the step of `particles` from its distributions, which need a covariance that is not singular."""
    import particles as library
    from particles import distributions, state_space_models

    covariance = NOISE @ NOISE.T + 1e-9 * np.eye(4)
    first = Gaussian(TRANSITION @ START.mean, TRANSITION @ START.covariance @ TRANSITION.T + covariance)

    class ConstantVelocity(state_space_models.StateSpaceModel):  # type: ignore[misc]
        def PX0(self):  # type: ignore[no-untyped-def] # noqa: ANN202, N802 - the library's names
            return distributions.MvNormal(loc=first.mean, cov=first.covariance)

        def PX(self, _t, xp):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return distributions.MvNormal(loc=xp @ TRANSITION.T, cov=covariance)

        def PY(self, _t, _xp, x):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202, N802
            return distributions.MvNormal(loc=x[:, :2], cov=SIGMA**2 * np.eye(2))

    fk = state_space_models.Bootstrap(ssm=ConstantVelocity(), data=list(measured))
    smc = library.SMC(fk=fk, N=count, resampling="systematic", ESSrmin=1.0, collect="off")

    def step(_t: int) -> Array:
        next(smc)
        mean: Array = smc.W @ smc.X
        return mean

    return step


def with_stone_soup(count: int, measured: Array) -> Step:
    """Build the step of Stone Soup."""
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import LinearGaussianTimeInvariantTransitionModel
    from stonesoup.predictor.particle import ParticlePredictor
    from stonesoup.resampler.particle import SystematicResampler
    from stonesoup.types.array import StateVectors
    from stonesoup.types.detection import Detection
    from stonesoup.types.hypothesis import SingleHypothesis
    from stonesoup.types.state import ParticleState
    from stonesoup.updater.particle import ParticleUpdater

    transition = LinearGaussianTimeInvariantTransitionModel(
        transition_matrix=TRANSITION, covariance_matrix=NOISE @ NOISE.T
    )
    measurement = LinearGaussian(ndim_state=4, mapping=(0, 1), noise_covar=SIGMA**2 * np.eye(2))
    predictor = ParticlePredictor(transition)
    updater = ParticleUpdater(measurement, SystematicResampler())
    samples = START.sample(np.random.default_rng(2), count).T
    log_weight = np.full(count, -np.log(count))
    state = ParticleState(StateVectors(samples), log_weight=log_weight, timestamp=CLOCK)

    def step(t: int) -> Array:
        nonlocal state
        now = CLOCK + timedelta(seconds=(t + 1) * INTERVAL)
        prediction = predictor.predict(state, timestamp=now)
        detection = Detection(measured[t].reshape(2, 1), timestamp=now, measurement_model=measurement)
        state = updater.update(SingleHypothesis(prediction, detection))
        return np.asarray(state.mean, dtype=float).ravel()

    return step


def with_filterpy(count: int, measured: Array) -> Step:
    """Build a step from NumPy and FilterPy's resampling, as its users do."""
    from filterpy.monte_carlo import systematic_resample

    rng = np.random.default_rng(2)
    states = START.sample(rng, count)

    def step(t: int) -> Array:
        nonlocal states
        states = states @ TRANSITION.T + rng.standard_normal((count, 2)) @ NOISE.T
        weights = np.exp(log_likelihood(states, measured[t]))
        weights /= weights.sum()
        mean: Array = weights @ states
        states = states[systematic_resample(weights)]
        return mean

    return step


def with_pfilter(count: int, measured: Array) -> Step:
    """Build the step of pfilter."""
    import pfilter

    rng = np.random.default_rng(2)
    tracker = pfilter.ParticleFilter(
        prior_fn=lambda n: START.sample(rng, n),
        observe_fn=lambda states: states[:, :2],
        dynamics_fn=lambda states: states @ TRANSITION.T,
        noise_fn=lambda states: states + rng.standard_normal((len(states), 2)) @ NOISE.T,
        weight_fn=lambda seen, real: pfilter.squared_error(seen, real, sigma=SIGMA),
        resample_fn=pfilter.systematic_resample,
        n_particles=count,
        resample_proportion=0.0,
        n_eff_threshold=1.0,
    )

    def step(t: int) -> Array:
        with np.errstate(all="ignore"):
            tracker.update(measured[t])
        mean: Array = tracker.mean_state
        return mean

    return step


LIBRARIES: dict[str, Callable[[int, Array], Step]] = {
    "pftrack": ours,
    "particles": with_particles_distributions,
    "particles, NumPy": with_particles,
    "Stone Soup": with_stone_soup,
    "FilterPy + NumPy": with_filterpy,
    "pfilter": with_pfilter,
}


def measure(count: int, steps: int) -> Iterator[dict[str, object]]:
    """Yield one row per library."""
    measured, exact, variances = data(steps)
    built, failures = {}, {}
    for name, build in LIBRARIES.items():
        try:
            built[name] = build(count, measured)
        except Exception as error:
            failures[name] = f"{type(error).__name__}: {error}"
    times: dict[str, list[float]] = {name: [] for name in built}
    estimates: dict[str, list[Array]] = {name: [] for name in built}
    order = list(built)
    for begin in range(0, steps, TURN):
        for name in order:
            step = built[name]
            for t in range(begin, min(begin + TURN, steps)):
                begun = perf_counter()
                estimate = step(t)
                times[name].append(perf_counter() - begun)
                estimates[name].append(estimate)
    warm = steps // 10
    fastest = median(times["pftrack"][warm:])
    for name in LIBRARIES:
        if name in failures:
            progress(f"{name}: {failures[name]}")
            yield {"library": name, "N": count, "ms": None, "ratio": None, "off": None, "right": None}
            continue
        typical = median(times[name][warm:])
        distance = float(np.sqrt(np.mean((np.array(estimates[name])[warm:] - exact[warm:]) ** 2 / variances[warm:])))
        yield {
            "library": name,
            "N": count,
            "ms": 1e3 * typical,
            "ratio": typical / fastest,
            "off": distance,
            "right": distance < RIGHT * count**-0.5,
        }


def main() -> None:
    """Measure and report."""
    given = arguments(__doc__.splitlines()[0], steps=Size(400, 40, "steps a library"))
    rows: list[dict[str, object]] = []
    for count in COUNTS:
        progress(f"N = {count}")
        rows += measure(count, given.steps if count < 10_000 else max(60, given.steps // 4))
    report("One SIR step, 4-D constant velocity, 2-D position measured", rows, as_json=given.json)


if __name__ == "__main__":
    main()
