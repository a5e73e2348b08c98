"""Explorations of a session's run and fits of its noise, through the REST interface."""

from typing import Any

import httpx
import numpy as np

import pftrack
from pftrack.analysis.other_seeds import ensemble
from pftrack_server.work.explorations import ExplorationJob
from tests.server.asking import columns, get
from tests.server.confined import children
from tests.server.follow_jobs import asked, ended, taken
from tests.server.host import Server, begin, error_of, post, steer
from tests.waiting import wait_for


def explore(client: httpx.Client, session: str, **body: Any) -> dict[str, Any]:
    return dict(post(client, f"sessions/{session}/explorations", **body))


def lost_session(client: httpx.Client, frames: int = 45) -> str:
    session = begin(client, frames=frames, parameters={"occlusion_width_px": 100})
    steer(client, session["id"], "seek", frame=20)
    return str(session["id"])


def test_a_line_of_what_if_opens_as_a_branch_that_holds(client: httpx.Client) -> None:
    """The list begins without a change; the seed of the best change makes a branch that has its target in the end.

    The new branch makes the result stale and does not delete it; back on the old branch it is valid again.
    """
    session = lost_session(client, frames=60)
    begun = explore(client, session, kind="what-if", frame=7, seconds=1)
    assert (begun["kind"], begun["name"], begun["error"]) == ("exploration", "what-if", None)
    found = ended(client, begun)
    assert (found["state"], found["stale"]) == ("done", False), found["error"]
    assert begun.keys() == found.keys() == ExplorationJob.model_fields.keys()
    assert 0 < found["done"] <= found["total"]
    result = found["result"]
    assert (result["loss"], result["end"], result["last"], result["findings"][0]["verdict"]) == (7, 37, 59, "baseline")
    assert result["first_lost_frame"] == columns(client, session)["lost"].index(True)
    for each in result["findings"]:
        assert each["shares"].startswith(f"{each['holding']} of {each['runs']} hold to frame 37")
        assert each["holding_at_end"] <= each["runs_to_end"] <= each["runs"]
        assert each["runs"] >= 11 or each["verdict"] in {"baseline", "few"}
    best = result["findings"][1]
    assert best["share"] >= result["findings"][-1]["share"]
    made = steer(client, session, "branch", frame=result["begin"], values=best["values"], seed=best["seed"])
    assert made["branch"] != begun["branch"]
    steer(client, session, "seek", frame=result["end"])
    lost = columns(client, session)["lost"][result["end"] - result["judged"] + 1 : result["end"] + 1]
    assert best["holding"] == 0 or not any(lost)
    later = asked(client, found)
    assert (later["stale"], later["result"]) == (True, result)
    steer(client, session, "activate", branch=found["branch"])
    assert not asked(client, found)["stale"]


def test_an_exported_page_says_what_would_have_saved_it(server: Server, client: httpx.Client) -> None:
    """The exported page has the result for this run beside *Why?*, both for one loss, and none for another run."""
    session = lost_session(client)
    steer(client, session, "restart", seed=0)
    steer(client, session, "seek", frame=20)
    found = ended(client, explore(client, session, kind="what-if", seconds=1))
    client.delete(f"/api/v1/jobs/{found['id']}")
    page = taken(client, session, "html").text
    assert found["result"]["sentence"] in page
    assert f"Lost in frame {found['result']['loss']}, first in frame 7:" in page
    steer(client, session, "restart", seed=77)
    assert server.app.state.services.explorations.found_of(server.manager.get(session)) is None


def test_other_seeds_are_those_of_the_library(client: httpx.Client) -> None:
    """The bands are those of the library's ensemble for the present settings."""
    session = lost_session(client, 21)
    found = ended(client, explore(client, session, kind="ensemble"))
    seed = get(client, session)["recipe"]["seed"]
    expected = ensemble(pftrack.run("ball", frames=21, seed=seed, occlusion_width_px=100))
    result = found["result"]
    assert (result["runs"], result["frames"], result["computed"]) == (40, 21, [40] * 21)
    np.testing.assert_array_equal(result["holding"], expected.holding)
    np.testing.assert_array_equal(result["middle"], expected.quantiles[1])


def test_a_session_asks_a_few_questions_at_a_time_and_ends_with_them(client: httpx.Client) -> None:
    """The fourth question is refused with the limit. With the session the processes of its questions end."""
    session, before = lost_session(client), set(children())
    begun = [explore(client, session, kind="what-if", seconds=300) for _ in range(3)]
    refused = client.post(f"/api/v1/sessions/{session}/explorations", json={"kind": "ensemble"})
    assert "at most 3 questions" in error_of(refused, 409)["message"]
    client.delete(f"/api/v1/jobs/{begun[0]['id']}")
    assert explore(client, session, kind="what-if", seconds=300)["state"] == "working"
    processes = wait_for(lambda: set(children()) - before, what="an exploration has processes")
    client.delete(f"/api/v1/sessions/{session}")
    wait_for(lambda: not (processes & set(children())), what="they are gone")


WRONG = {"assumed_noise_sd": 0.4}


def fitted(client: httpx.Client, session: dict[str, Any], *numbers: str) -> dict[str, Any]:
    return ended(client, client.post(f"/api/v1/sessions/{session['id']}/fits", json={"numbers": numbers}))


def test_a_fit_says_what_the_library_says(client: httpx.Client) -> None:
    """The fit to the computed frames is the library's to the bit; the session lists the numbers of each tracker.

    A short run and an unknown number are refused with the reason; a cancelled fit is deleted.
    """
    session = begin(client, experiment="sine", tracker="kalman", parameters=WRONG, seed=3)
    assert session["fittable"]["kalman"] == ["process_noise_sd", "assumed_noise_sd"]
    assert "at least 41 frames" in fitted(client, session, "assumed_noise_sd")["error"]
    assert "Kalman filter has no number 'sample_count'" in fitted(client, session, "sample_count")["error"]
    steer(client, session["id"], "seek", frame=40)
    found = fitted(client, session, "assumed_noise_sd")
    run = pftrack.run("sine", tracker="kalman", seed=3, frames=41, **WRONG)
    assert found["state"] == "done"
    assert found["result"] == pftrack.fit(run, ["assumed_noise_sd"]).as_dict()
    assert found["done"] <= found["total"]
    address = f"/api/v1/sessions/{session['id']}/fits"
    error_of(client.post(address, json={"numbers": []}), 422)
    begun = client.post(address, json={"numbers": ["assumed_noise_sd"]}).json()
    assert client.delete(f"/api/v1/jobs/{begun['id']}").status_code == 204
    error_of(client.get(f"/api/v1/jobs/{begun['id']}"), 404)
