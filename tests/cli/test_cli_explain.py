"""The command line's explanation of a loss."""

import json
from pathlib import Path

import pftrack
from tests.cli.commands import Call, refused


def test_a_saved_run_is_explained_by_command_as_in_python(call: Call, tmp_path: Path) -> None:
    """`pftrack explain` prints what `run.explain()` says, and `--json` all of it; a frame may be asked for."""
    values = {"occlusion_width_px": 0, "distracter_radius_px": 0, "process_noise_px": 0.1, "period_s": 2}
    run, file = pftrack.run("ball", tracker="kalman", frames=60, **values), tmp_path / "lost.pft"
    run.save(file)
    explained = run.explain()
    code, out, _ = call("explain", str(file), "--seeds", "0")
    assert (code, out.splitlines()) == (0, list(explained.lines))
    assert json.loads(call("explain", str(file), "--seeds", "0", "--json")[1]) == json.loads(
        json.dumps(explained.as_dict())
    )
    asked = json.loads(call("explain", str(file), "--frame", "30", "--seeds", "0", "--json")[1])["diagnosis"]
    assert asked["cause"] == "shrinking-covariance"
    refused(call("explain", str(file), "--frame", "60"), 2, "--frame must be a whole number between 0 and 59")
    refused(call("explain", str(file), "--seeds", "-1"), 2, "--seeds must be a whole number between 0 and 1000")
