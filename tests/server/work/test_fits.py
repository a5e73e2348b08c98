"""Fits over REST: they say what the library says, go on beside the session, and can be cancelled."""

from typing import Any

import httpx

import pftrack
from tests.server.follow_jobs import ended
from tests.server.host import begin, error_of, steer

WRONG = {"assumed_noise_sd": 0.4}


def fitted(client: httpx.Client, session: dict[str, Any], *numbers: str) -> dict[str, Any]:
    return ended(client, client.post(f"/api/v1/sessions/{session['id']}/fits", json={"numbers": numbers}))


def test_a_fit_says_what_the_library_says(client: httpx.Client) -> None:
    """To the bit, of the frames that were computed; which numbers there are, the session tells by tracker."""
    session = begin(client, experiment="sine", tracker="kalman", parameters=WRONG, seed=3)
    assert session["fittable"]["kalman"] == ["process_noise_sd", "assumed_noise_sd"]
    steer(client, session["id"], "seek", frame=80)
    told = fitted(client, session, "assumed_noise_sd")
    run = pftrack.run("sine", tracker="kalman", seed=3, frames=81, **WRONG)
    assert told["state"] == "done"
    assert told["result"] == pftrack.fit(run, ["assumed_noise_sd"]).as_dict()
    assert told["done"] <= told["total"]


def test_what_cannot_be_fitted_is_told(client: httpx.Client) -> None:
    """A short run and a number that is none say why; a fit that was cancelled is gone."""
    session = begin(client, experiment="sine", tracker="kalman", parameters=WRONG)
    assert "at least 41 frames" in fitted(client, session, "assumed_noise_sd")["error"]
    assert "Kalman filter has no number 'sample_count'" in fitted(client, session, "sample_count")["error"]
    address = f"/api/v1/sessions/{session['id']}/fits"
    error_of(client.post(address, json={"numbers": []}), 422)
    begun = client.post(address, json={"numbers": ["assumed_noise_sd"]}).json()
    assert client.delete(f"/api/v1/jobs/{begun['id']}").status_code == 204
    error_of(client.get(f"/api/v1/jobs/{begun['id']}"), 404)
