"""What else a session's run might have been, and which noises fit it, asked through the REST interface."""

from typing import Any

import httpx
import numpy as np

import pftrack
from pftrack.analysis.other_seeds import ensemble
from pftrack_server.work.explorations import ExplorationJob
from tests.server.asking import columns, get
from tests.server.confined import children
from tests.server.follow_jobs import asked, ended, taken
from tests.server.host import begin, error_of, steer
from tests.waiting import wait_for


def explore(client: httpx.Client, session: str, **body: Any) -> dict[str, Any]:
    answer = client.post(f"/api/v1/sessions/{session}/explorations", json=body)
    assert answer.status_code == 202, answer.text
    return dict(answer.json())


def lost_session(client: httpx.Client, frames: int = 45) -> str:
    session = begin(client, frames=frames, parameters={"occlusion_width_px": 100})
    steer(client, session["id"], "seek", frame=20)
    return str(session["id"])


def test_a_line_of_what_if_opens_as_a_branch_that_holds(client: httpx.Client) -> None:
    """A list comes, no change first; the seed of the best change makes a branch that has its target in the end.

    The change makes what was found stale and does not drop it; back on its branch it is what it was.
    """
    session = lost_session(client, frames=60)
    begun = explore(client, session, kind="what-if", frame=7, seconds=3)
    assert (begun["kind"], begun["name"], begun["error"]) == ("exploration", "what-if", None)
    found = ended(client, begun)
    assert (found["state"], found["stale"]) == ("done", False), found["error"]
    assert begun.keys() == found.keys() == ExplorationJob.model_fields.keys(), "what it keeps for itself is not told"
    assert 0 < found["done"] <= found["total"]
    told = found["result"]
    assert (told["loss"], told["end"], told["last"], told["findings"][0]["verdict"]) == (7, 37, 59, "baseline")
    assert told["first_lost_frame"] == columns(client, session)["lost"].index(True)
    for each in told["findings"]:
        assert each["shares"].startswith(f"{each['holding']} of {each['runs']} hold to frame 37")
        assert each["holding_at_end"] <= each["runs_to_end"] <= each["runs"]
        assert each["runs"] >= 11 or each["verdict"] in {"baseline", "few"}
    best = told["findings"][1]
    assert best["share"] >= told["findings"][-1]["share"]
    made = steer(client, session, "branch", frame=told["begin"], values=best["values"], seed=best["seed"])
    assert made["branch"] != begun["branch"]
    steer(client, session, "seek", frame=told["end"])
    lost = columns(client, session)["lost"][told["end"] - told["judged"] + 1 : told["end"] + 1]
    assert best["holding"] == 0 or not any(lost)
    later = asked(client, found)
    assert (later["stale"], later["result"]) == (True, told)
    steer(client, session, "activate", branch=found["branch"])
    assert not asked(client, found)["stale"]


def test_an_exported_page_says_what_would_have_saved_it(client: httpx.Client) -> None:
    """What was found of the run as it is stands in its page beside *Why?*, both of one loss; of another it does not."""
    session = lost_session(client)
    steer(client, session, "restart", seed=0)
    steer(client, session, "seek", frame=20)
    found = ended(client, explore(client, session, kind="what-if", seconds=1))
    client.delete(f"/api/v1/jobs/{found['id']}")
    for is_there in (True, False):
        page = taken(client, session, "html").text
        assert (found["result"]["sentence"] in page) == is_there
        assert (f"Lost in frame {found['result']['loss']}, first in frame 7:" in page) == is_there
        steer(client, session, "restart", seed=77)


def test_other_seeds_are_those_of_the_library(client: httpx.Client) -> None:
    """The bands are those of an ensemble in Python, for the settings that are in force now."""
    session = lost_session(client, 30)
    found = ended(client, explore(client, session, kind="ensemble"))
    seed = get(client, session)["recipe"]["seed"]
    expected = ensemble(pftrack.run("ball", frames=30, seed=seed, occlusion_width_px=100))
    told = found["result"]
    assert (told["runs"], told["frames"], told["computed"]) == (40, 30, [40] * 30)
    np.testing.assert_array_equal(told["holding"], expected.holding)
    np.testing.assert_array_equal(told["middle"], expected.quantiles[1])


def test_a_run_that_holds_is_told_so(client: httpx.Client) -> None:
    """The refusal is a sentence, and comes when the run has been looked at."""
    session = begin(client, frames=20)["id"]
    found = ended(client, explore(client, session, kind="what-if"))
    assert (found["state"], found["error"]) == ("failed", "The run has not lost its target so far")


def test_a_session_asks_a_few_questions_at_a_time_and_ends_with_them(client: httpx.Client) -> None:
    """The fourth is refused with a sentence that says how many there may be.

    Their processes are gone long before their time is over, since nobody can ask for what they find.
    """
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
