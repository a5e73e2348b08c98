"""How an experiment's rows become states to learn from."""

from dataclasses import replace

import numpy as np
import pytest

from pftrack.core.model.tracker import Diagnostics
from pftrack.core.refusal import ConflictError, ParameterError, RefusedError
from pftrack.filters.learning.charts import Chart
from pftrack.filters.learning.diffusion import Guidance, learn

FISH = Chart(place=("a", "b"), heading="theta", angles=("phi",))
TRACK = np.cumsum(np.random.default_rng(0).normal(size=(40, 4)), axis=0)
BUILT_IN = learn([TRACK], FISH, "fish").text
GUIDANCE = Guidance("fish", FISH, BUILT_IN, series="body")

ROW = Diagnostics(0, 0.0, (1.0, 2.0), (1.0, 1.0), 0.0, None, None, None, None, None, None, None, 0.1)


def rows() -> list[Diagnostics]:
    return [replace(ROW, frame=frame, series={"body": tuple(state.tolist())}) for frame, state in enumerate(TRACK)]


def test_states_are_read_from_the_declared_series() -> None:
    """A row's state is its vector; a frame that is lost, searched for or without the vector is a gap."""
    several = rows()
    assert np.array_equal(GUIDANCE.states(several), TRACK)
    several[3] = replace(several[3], lost=True)
    several[7] = replace(several[7], searching=True)
    several[9] = replace(several[9], series={})
    gaps = np.flatnonzero(np.isnan(GUIDANCE.states(several)).any(axis=1))
    assert gaps.tolist() == [3, 7, 9]


def test_estimates_are_brought_to_the_units_of_the_chart() -> None:
    """Without a series the estimate is read, divided by what the experiment's unit is in that of the chart."""
    pose = Guidance("prism", Chart(angles=("x", "y")), "", scale=180 / np.pi)
    assert pose.states([replace(ROW, estimate=(90.0, 180.0))]) == pytest.approx(np.array([[np.pi / 2, np.pi]]))


def test_a_state_of_another_length_is_refused() -> None:
    """A row that holds fewer or more numbers than a state has is named; a single one does not fill all of them."""
    for length in (1, 3, 5):
        short = rows()
        short[6] = replace(short[6], series={"body": tuple(range(length))})
        expected = f"frame 6 must hold a state of a, b, theta, phi to learn from, 4 numbers, got {length}"
        with pytest.raises(RefusedError, match=expected):
            GUIDANCE.states(short)


def test_a_saved_run_gives_the_same_states() -> None:
    """The columns of a file are read as the rows are; a file without them is refused."""
    lost = np.zeros(40)
    lost[4] = 1
    columns = {"series_body": TRACK, "lost": lost, "searching": np.full(40, np.nan)}
    states = GUIDANCE.saved_states(columns, "run.pft")
    assert np.flatnonzero(np.isnan(states).any(axis=1)).tolist() == [4]
    for damaged in ({}, {"series_body": TRACK[:, :3]}, {"series_body": np.array(["x"])}):
        with pytest.raises(RefusedError, match=r"run\.pft holds no states of a, b, theta, phi"):
            GUIDANCE.saved_states(damaged, "run.pft")


def test_the_open_run_is_offered_as_a_file() -> None:
    """The export of a run is what its rows teach."""
    export = GUIDANCE.export
    assert export.make(None, rows()).decode() == BUILT_IN
    assert (export.suffix, export.media_type) == ("learned.json", "application/json")
    with pytest.raises(ConflictError, match="at least 20 frames"):
        export.make(None, rows()[:5])


def test_without_a_file_what_is_built_in_is_used() -> None:
    """An empty text stands for what comes with the experiment; another is read, or refused as a parameter is."""
    assert GUIDANCE.parse("").text == BUILT_IN
    with pytest.raises(ParameterError, match=r"learned must be a learned motion \(it is not JSON"):
        GUIDANCE.parse("nonsense")
