"""The command line's fit of noises."""

import json
from pathlib import Path

import pftrack
from pftrack.core.model.parameters import flat
from pftrack.core.model.recipe import Change
from tests.cli.commands import Call, refused


def test_fitted_values_hold_in_all_frames_of_the_saved_run(call: Call, tmp_path: Path) -> None:
    """A later change of a fitted number is dropped; a change of another number stays."""
    file, out = tmp_path / "run.pft", tmp_path / "fitted.pft"
    recipe = pftrack.run("sine", tracker="kalman", seed=7, frames=200, assumed_noise_sd=0.4).recipe
    later = Change(50, {"assumed_noise_sd": 0.3, "observation_noise_sd": 0.11})
    run = pftrack.run(recipe.model_copy(update={"timeline": (*recipe.timeline, later)}))
    run.save(file)
    code, told, _ = call("fit", str(file), "assumed_noise_sd", "--out", str(out), "--json")
    found = json.loads(told)
    assert (code, found["kept"]) == (0, True)
    assert found == json.loads(json.dumps(pftrack.fit(run, ["assumed_noise_sd"]).as_dict()))
    saved = pftrack.load(out)
    for frame, noise in ((0, 0.1), (49, 0.1), (50, 0.11), (199, 0.11)):
        expected = {**found["values"], "observation_noise_sd": noise}
        assert expected.items() <= flat(saved.parameters_at(frame)).items()


def test_a_rejected_fit_is_not_saved(call: Call, tmp_path: Path) -> None:
    """The second half of the run does not confirm it; an unknown name is refused."""
    file, out = tmp_path / "run.pft", tmp_path / "fitted.pft"
    pftrack.run("sine", tracker="kalman", seed=7, frames=60).save(file)
    code, told, err = call("fit", str(file), "assumed_noise_sd", "--out", str(out))
    assert (code, "Not " in told, "was not written" in err, out.exists()) == (0, True, True, False)
    refused(call("fit", str(file), ""), 1, "Kalman filter has no number '' that can be fitted; there are process")
