"""Looking into trajectories: the particles of the selected track, its likelihood, and what the frame did to it."""

import numpy as np
import pytest

from pftrack.core.model.likelihood import Contributions, Patches, Residual
from pftrack.experiments import find
from pftrack.filters.trajectories.cloud import Cloud
from pftrack.runs.inspection import Inspection
from pftrack.runs.run import Run
from tests.making import whole_run


def looked_into(tracker: str, frame: int = 6) -> Inspection:
    """The scene of corners at a frame, looked into."""
    found = find("trajectories")
    run = whole_run(found, tracker=tracker, seed=2, frames=frame + 1)
    return Inspection(run)


@pytest.mark.parametrize(("tracker", "coordinates"), [("lng", 2), ("nlng", 4)])
def test_particles_descend_from_those_of_the_frame_before(tracker: str, coordinates: int) -> None:
    """A particle's parent is where the tree of the track has it, and weights are how often each was drawn."""
    look = looked_into(tracker)
    cloud, belief = look.cloud, look.run.current.state.belief
    assert isinstance(belief, Cloud)
    assert cloud is not None
    assert cloud.ancestors is not None
    assert cloud.states.shape[1] == coordinates
    track = look.run.current.state.selected
    first, last = belief.offsets[track, :2]
    kept = belief.age(track, 1)[0][belief.parents[first:last]]
    particle = int(cloud.log_weights.argmax())
    found = look.at_particle(particle)
    assert found.particle is not None
    np.testing.assert_array_equal(found.particle.path[1], kept[particle])
    assert found.particle.rank == 1
    assert np.exp(cloud.log_weights).sum() == pytest.approx(1.0)
    lineage = look.genealogy()
    assert lineage is not None
    assert (np.diff(lineage.counts) > 0).all()


@pytest.mark.parametrize("tracker", ["lng", "nlng", "lg"])
def test_the_likelihood_is_greatest_where_the_track_is_measured(tracker: str) -> None:
    """A map covers the picture, template and place lie beside each other, and each axis is told by itself."""
    look = looked_into(tracker)
    state = look.run.current.state
    measured = state.raw[0, state.selected]
    found = look.map((640, 480))
    assert found is not None
    row, column = np.unravel_index(found.log_likelihoods.argmax(), found.log_likelihoods.shape)
    assert np.abs(found.step_px * np.array([column, row]) + found.step_px // 2 - measured).max() <= found.step_px
    here = look.at_place(measured)
    (patches, *compared) = here.parts
    assert isinstance(patches, Patches)
    assert patches.expected_rgb.shape == patches.found_rgb.shape
    assert all(isinstance(part, Residual) and part.found == part.expected for part in compared)
    assert (here.log_likelihood or 0.0) > (look.at_place(measured + 3.0).log_likelihood or 0.0)


def test_the_kalman_filter_tells_its_innovation() -> None:
    """The density of a track's measurement is that of its normalised innovation squared and expected deviation."""
    look = looked_into("lg")
    *told, table = look.update_parts()
    row = look.run.current.diagnostics
    deviation = next(part.sd for part in told if isinstance(part, Residual))
    expected = -np.log(2.0 * np.pi * deviation**2) - 0.5 * row.number("nis")
    assert row.number("track_log_evidence") == pytest.approx(expected)
    assert (row.number("nis_freedom"), row.number("nis_limit")) == (2.0, 5.991465)
    assert isinstance(table, Contributions)
    distances = [numbers[2] for numbers in table.rows]
    assert distances == sorted(distances, reverse=True)
    assert len(table.arrows) == len(table.names) == 12


def test_another_track_has_other_particles() -> None:
    """Where the selection changes no particle has a parent, since those of the frame before are another track's."""
    found = find("trajectories")
    run = Run(found, found.simulate(), tracker="lng", seed=2, frames=6)
    run.seek(3)
    run.change({"selected_track": 5})
    run.seek(4)
    cloud = Inspection(run).cloud
    assert cloud is not None
    assert cloud.ancestors is None
    run.seek(5)
    assert Inspection(run).cloud.ancestors is not None  # type: ignore[union-attr] - there are particles
