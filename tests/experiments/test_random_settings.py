"""Bands of Kalman filters are declared by the settings: what their noises and the path of the target lead to."""

from collections.abc import Mapping

import pytest

from pftrack.core.model.band import MOST, Direction
from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.runs.coverage import count_held, pool_counts
from pftrack.runs.run import Run
from pftrack.testing.coverage import judge
from tests.making import whole_run

CLEAR: Mapping[str, Value] = {"occlusion_width_px": 0, "distracter_radius_px": 0, "clutter_count": 0}


def run_of(name: str, chosen: Mapping[str, Value], seed: int) -> Run:
    experiment, frames = find(name), 361 if name == "sine" else 120
    return whole_run(experiment, tracker="kalman", seed=seed, frames=frames, values=dict(chosen))


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
    assert set(runs[0].experiment.miscalibration(("kalman", runs[0].parameters_at(1)))) == directions


@pytest.mark.parametrize(
    "chosen",
    [
        {"observation_noise_sd": 0.4},
        {"waveform": "sine", "observation_noise_sd": 0.2},
        {"assumed_noise_sd": 0.04, "initial_sd": 0.4},
        {"process_noise_sd": 0.02, "waveform": "sine", "initial_sd": 1.0},
    ],
)
def test_the_coverage_of_a_kalman_filter_is_foreseen(chosen: Mapping[str, Value]) -> None:
    """From its noises, the true ones and the path, whatever they are."""
    runs = [run_of("sine", chosen, seed) for seed in range(4)]
    share = next(it.share for it in pool_counts(map(count_held, runs)) if it.promised == MOST)
    assert runs[0].parameters_at(1).kalman_coverage == pytest.approx(share, abs=0.05)
