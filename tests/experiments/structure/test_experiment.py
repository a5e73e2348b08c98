"""The experiment of a body's shape: its presets, its measures, and what is drawn."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pftrack.core.model.drawing import Ellipse
from pftrack.core.model.preset import Preset
from pftrack.core.model.setup import find_export
from pftrack.experiments import find
from pftrack.experiments.structure.experiment import shape_errors, shape_world
from pftrack.runs.run import Run
from pftrack.sources.sequence import open_sequence
from pftrack.sources.tracks import read_tracks
from pftrack.vision.face import FEATURES, fit_similarity, mean_model, person
from pftrack.vision.structure.factorization import shape_error
from tests.making import whole_run

EXPERIMENT = find("structure")


def run_of(preset: Preset, frames: int | None = None) -> Run:
    return whole_run(EXPERIMENT, values=preset.parameters, tracker=preset.tracker, seed=preset.seed, frames=frames)


@pytest.mark.parametrize("preset", EXPERIMENT.presets, ids=lambda preset: preset.name)
def test_presets_do_what_they_say(preset: Preset) -> None:
    """What works ends in success, what is worse or breaks does not; only mirrored depth is an error as a solid."""
    run = run_of(preset, None if preset.title.startswith("works") else 80)
    if preset.name == "mirror":
        mirrored = [row.series["mirrored"] for row in run.diagnostics[30:]]
        assert np.mean(mirrored) > 0.5
        assert run.diagnostics[-1].series["metric_error"] > 10 * run.diagnostics[-1].error
    else:
        assert run.summary().verdict.success == preset.title.startswith("works")


def test_the_error_is_that_of_bando() -> None:
    """It is eq. 4.19 in percent for a solid shape, also of many at once, and is known of a flat one."""
    truths, estimates = np.random.default_rng(0).standard_normal((2, 5, 9, 3))
    found = shape_errors(estimates.reshape(5, 27), truths.reshape(5, 27))
    wanted = [100 * shape_error(one, other) for one, other in zip(estimates, truths, strict=True)]
    np.testing.assert_allclose(found, wanted, rtol=1e-9)
    flat = (truths[0] * np.array([1.0, 1.0, 0.0])).ravel()
    centred = truths[0] - truths[0].mean(axis=0)
    across, depth = centred[:, :2], centred[:, 2]
    left = depth - across @ np.linalg.lstsq(across, depth, rcond=None)[0]
    known = 100 * np.linalg.norm(left) / np.linalg.norm(centred)
    assert shape_errors(flat, truths[0].ravel()) == pytest.approx(known)
    assert np.isnan(shape_errors(flat, np.zeros(27)))


def test_what_is_endlessly_unsure_has_no_ellipsoid() -> None:
    """Its covariance may be no number of 32 bits."""
    run = run_of(EXPERIMENT.presets[0], 22)
    state = run.current.state
    covariances = state.placed.covariances.copy()
    covariances[3] *= 1e60
    unsure = replace(state, placed=replace(state.placed, covariances=covariances))
    before, after = (shape_world(one, run.current.frame.target).primitives["uncertainty"] for one in (state, unsure))
    assert len(after.covariances) == len(before.covariances) - 1
    assert np.isfinite(after.covariances).all()


def test_hidden_points_are_rings_and_ellipsoids_shrink() -> None:
    """A point that is hidden is drawn as a ring where the shape has it; the ellipsoids are smaller later."""
    sizes = []
    for frames in (22, 202):
        run = run_of(EXPERIMENT.presets[0], frames)
        drawing, names = EXPERIMENT.draw(run.current, run.diagnostics), run.current.state.body.names
        visible = run.current.frame.target.landmarks.visible
        rings = {name: item for name, item in drawing.primitives.items() if name.startswith("hidden ")}
        assert rings.keys() == {f"hidden {name}" for name, seen in zip(names, visible, strict=True) if not seen}
        assert {type(item) for item in rings.values()} == {Ellipse}
        (world,) = drawing.worlds
        sizes.append(np.trace(world.primitives["uncertainty"].covariances, axis1=1, axis2=2).mean())
    assert sizes[1] < sizes[0] / 2


def test_tracks_of_a_head_teach_its_face(tmp_path: Path) -> None:
    """What a head's tracker has seen of the features, brought here as a table, tells the face from the mean one."""
    head, table, true = find("head"), tmp_path / "tracks.csv", person(210).points_mm
    tracked = whole_run(head, seed=7, frames=240, values={"person": 210})
    table.write_bytes(find_export(head.exports, "tracks").make(tracked.current.state, tracked.diagnostics))
    run = Run(EXPERIMENT, EXPERIMENT.video.on_video(open_sequence(table), None))
    shapes = (run.finish().state.placed.points, mean_model().points_mm)
    found, mean = (np.square(fit_similarity(it, true)(it) - true).sum(axis=1).mean() for it in shapes)
    assert np.sqrt(found) < 0.85 * np.sqrt(mean)


def test_the_table_of_a_head_s_tracks_says_what_the_rows_say() -> None:
    """Positions and variances are those of the series; what was not recognised, or not measured, has no line."""
    head = find("head")
    tracked = whole_run(head, seed=3, frames=3, values={"image_width_px": 320})
    first, second, third = tracked.diagnostics
    hidden = {**second.series, "track_sd_px": (np.nan, *second.series["track_sd_px"][1:])}
    past = [first, replace(second, series=hidden), replace(third, series={})]
    table = read_tracks(find_export(head.exports, "tracks").make(None, past), most_frames=10)
    assert table.names == FEATURES
    assert table.positions.shape == (2, 11, 2)
    for row, positions, variances in zip(past, table.positions, table.variances, strict=False):
        sd = np.array(row.series["track_sd_px"])
        seen = np.isfinite(sd)
        assert np.isfinite(positions).all(axis=1).tolist() == seen.tolist()
        wanted = np.stack([row.series["feature_x_px"], row.series["feature_y_px"]], axis=1)
        np.testing.assert_array_equal(positions[seen], wanted[seen])
        np.testing.assert_allclose(variances[seen, 0], np.square(sd)[seen])
    np.testing.assert_array_equal(third.series["feature_x_px"], tracked.current.state.feature_means[:, 0])
