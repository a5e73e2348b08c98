"""Bands are declared by the settings: drawn anywhere, they hold the truth as often as they say or it is said."""

import math
from collections.abc import Mapping

import numpy as np
import pytest

from pftrack.core.model.band import Direction
from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.runs.coverage import count_held, pool_counts
from pftrack.runs.run import Run
from pftrack.testing.coverage import find_contradictions, judge
from tests.making import whole_run

CLEAR: Mapping[str, Value] = {"occlusion_width_px": 0, "distracter_radius_px": 0, "clutter_count": 0}


def run_of(name: str, chosen: Mapping[str, Value], seed: int) -> Run:
    experiment, frames = find(name), 361 if name == "sine" else 120
    return whole_run(experiment, tracker="kalman", seed=seed, frames=frames, values=dict(chosen))


def contradictions(name: str, chosen: Mapping[str, Value], seeds: int) -> list[str]:
    """Return what runs say of the bands that is not declared; half a tenth is allowed for what is at an edge."""
    runs = [run_of(name, chosen, seed) for seed in range(seeds)]
    faults = [it for it in find(name).quality.calibration.faults if it.holds("kalman", runs[0].parameters_at(1))]
    return list(find_contradictions(faults, pool_counts(map(count_held, runs)), slack=0.05))


@pytest.mark.parametrize(
    ("name", "chosen", "directions"),
    [
        ("ball", CLEAR, {"underconfident"}),
        ("ball", {**CLEAR, "process_noise_px": 0.5}, {"overconfident"}),
        ("ball", {**CLEAR, "distracter_radius_px": 4}, {"overconfident"}),
        ("sine", {}, set()),
        ("sine", {"assumed_noise_sd": 0.3}, {"underconfident"}),
        ("sine", {"assumed_noise_sd": 0.3, "waveform": "sine"}, {"overconfident"}),
        ("sine", {"assumed_noise_sd": 0.03}, {"overconfident"}),
        ("sine", {"process_noise_sd": 0.0002}, {"overconfident"}),
    ],
)
def test_what_is_declared_depends_on_the_settings(
    name: str, chosen: Mapping[str, Value], directions: set[Direction]
) -> None:
    """A Kalman filter is declared as surer or less sure than it may be where it is, and nowhere else."""
    runs = [run_of(name, chosen, seed) for seed in range(1 if name == "ball" else 4)]
    found = judge(pool_counts(map(count_held, runs)))
    assert {found} - {None} == directions
    assert set(runs[0].miscalibration) == directions


def draw(name: str, rng: np.random.Generator) -> dict[str, Value]:
    """Return settings of scene and filter, noises over two orders of magnitude."""

    def between(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    if name == "sine":
        noise = between(0.03, 1.0)
        return {
            "waveform": str(rng.choice(["sine", "cosine"])),
            "dimension": int(rng.integers(1, 4)),
            "observation_noise_sd": noise,
            "assumed_noise_sd": noise * between(0.3, 4.0),
            "process_noise_sd": between(1e-4, 0.1),
            "initial_sd": float(rng.choice([0.0, 0.1, 1.0])),
        }
    return {
        "occlusion_width_px": float(rng.choice([0, 0, 20, 40, 80])),
        "distracter_radius_px": float(rng.choice([0, 0, 2, 4, 8])),
        "clutter_count": int(rng.choice([0, 0, 0, 5])),
        "ball_path": str(rng.choice(["swings", "bounces"])),
        "period_s": float(rng.choice([0.5, 1.0, 2.0])),
        "process_noise_px": between(0.5, 30.0),
        "measurement_noise_px": between(1.0, 40.0),
        "velocity_retention": float(rng.choice([1.0, 1.0, 0.9])),
    }


@pytest.mark.slow
@pytest.mark.parametrize(("name", "seeds"), [("sine", 6), ("ball", 2)])
def test_settings_drawn_at_random(name: str, seeds: int) -> None:
    """Of forty settings at most one in ten has a band that is off and not declared."""
    rng = np.random.default_rng(2026)
    wrong = [
        (chosen, said)
        for chosen in (draw(name, rng) for _ in range(40))
        if (said := contradictions(name, chosen, seeds))
    ]
    assert len(wrong) <= 4, wrong
