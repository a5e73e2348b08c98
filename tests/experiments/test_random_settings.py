"""Bands of the signal's Kalman filter are declared right only if its noises are near the true ones."""

from collections.abc import Mapping

import pytest

from pftrack.core.model.band import Finding
from pftrack.core.model.parameters import Value
from pftrack.experiments import find
from pftrack.runs.coverage import count_held, pool_counts
from pftrack.testing.coverage import judge
from tests.making import whole_run


@pytest.mark.parametrize(
    ("chosen", "found"),
    [
        ({}, "right"),
        ({"assumed_noise_sd": 0.3}, "underconfident"),
        ({"assumed_noise_sd": 0.3, "waveform": "sine"}, "overconfident"),
        ({"assumed_noise_sd": 0.03}, "overconfident"),
        ({"process_noise_sd": 0.0002}, "overconfident"),
    ],
)
def test_wrong_bands_are_not_declared_right(chosen: Mapping[str, Value], found: Finding) -> None:
    """Bands measured to be wrong are declared uncalibrated; those of the default scene are right."""
    sine = find("sine")
    runs = [whole_run(sine, tracker="kalman", seed=seed, frames=361, values=dict(chosen)) for seed in range(4)]
    assert judge(pool_counts(map(count_held, runs))) == found
    assert runs[0].doubts == (() if found == "right" else ("uncalibrated",))
