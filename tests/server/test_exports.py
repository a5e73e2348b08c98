"""Files of the frame that is shown: what an experiment declares is listed and can be fetched, and nothing else."""

import json

import httpx
import numpy as np
import pytest

from pftrack.experiments import find
from pftrack.runs.exports import FORMATS, exports_of
from pftrack.runs.run import Change, Run
from tests.notebooks import executed
from tests.server.host import begin, error_of, steer

SMALL = {"image_width_px": 320, "feature_noise_px": 3, "face_model": "growing"}


def test_a_session_exports_what_its_experiment_offers(client: httpx.Client) -> None:
    """Each file that is listed comes with its name and type; the points are those of the same run in the library."""
    session = begin(client, experiment="head", parameters=SMALL, seed=1)
    offered = {one["name"]: one for one in session["exports"]}
    assert set(offered) == {one.name for one in exports_of(find("head"))}
    steer(client, session["id"], "seek", frame=3)
    learned = client.get(f"/api/v1/sessions/{session['id']}/exports/{offered.pop('learned')['name']}")
    assert "at least 15 frames with a frame known before them" in error_of(learned, 409)["message"]
    for name, one in offered.items():
        answer = client.get(f"/api/v1/sessions/{session['id']}/exports/{name}")
        assert answer.status_code == 200
        assert answer.headers["content-type"].split(";")[0] == one["media_type"]
        assert f'filename="head-3.{one["suffix"]}"' in answer.headers["content-disposition"]
        assert len(answer.content) > 40
    said = json.loads(client.get(f"/api/v1/sessions/{session['id']}/exports/face-json").content)
    run = Run(find("head"), find("head").simulate(), seed=1, timeline=(Change(0, SMALL),))
    run.seek(3)
    shape = run.current.state.memory.growth.shape
    np.testing.assert_allclose(list(said["points"].values()), shape, atol=1e-4)
    assert said["frames"] == 3


def test_what_cannot_be_made_of_these_frames_is_told(client: httpx.Client) -> None:
    """A learned motion needs more frames than the first: it is refused with the reason, and the session goes on."""
    session = begin(client)
    address = f"/api/v1/sessions/{session['id']}/exports/learned"
    said = error_of(client.get(address), 409)["message"]
    assert "xpected at least 10 frames with two frames known before them, got 0" in said
    steer(client, session["id"], "seek", frame=40)
    learned = find("ball").guidance.learned(client.get(address).text)
    assert (learned.tracks, learned.experiment) == (1, "ball")


def test_a_session_is_guided_by_a_learned_file(client: httpx.Client) -> None:
    """A file is taken up in a session as a parameter is, whose numbers are the library's; a wrong one is refused."""
    session = begin(client, tracker="guided")
    address = f"/api/v1/sessions/{session['id']}"
    steer(client, session["id"], "seek", frame=40)
    text = client.get(f"{address}/exports/learned").text
    wrong = client.patch(f"{address}/parameters", json={"learned": text.replace('"ball"', '"fish"')})
    assert "it was learned in 'fish', and this is 'ball'" in error_of(wrong, 422)["message"]
    assert client.patch(f"{address}/parameters", json={"learned": text}).status_code == 200
    steer(client, session["id"], "restart")
    steer(client, session["id"], "seek", frame=12)
    ball = find("ball")
    changes = (Change(0, {"learned": text}),)
    run = Run(ball, ball.simulate(), tracker="guided", seed=session["recipe"].get("seed", 0), timeline=changes)
    run.seek(12)
    columns = client.get(f"{address}/diagnostics").json()
    assert columns["columns"]["estimate"][12] == list(run.current.diagnostics.estimate)


def test_a_session_is_taken_away_as_a_notebook_with_its_numbers(client: httpx.Client) -> None:
    """What was changed on the way is in it; run, it comes to the estimates that the session has."""
    session = begin(client, experiment="sine", seed=5)
    address = f"/api/v1/sessions/{session['id']}"
    steer(client, session["id"], "seek", frame=3)
    assert client.patch(f"{address}/parameters", json={"sample_count": 40}).status_code == 200
    steer(client, session["id"], "seek", frame=9)
    answer = client.get(f"{address}/exports/notebook")
    assert answer.headers["content-type"] == "application/x-ipynb+json"
    printed = executed(answer.content)
    assert "The same estimates as in the run that was exported.\n" in printed
    table = next(text for text in printed if "log_evidence" in text).splitlines()
    said = client.get(f"{address}/diagnostics").json()["columns"]["log_evidence"]
    place = table[0].split().index("log_evidence")
    assert [float(row.split()[place]) for row in table[1:]] == pytest.approx(said, rel=1e-4)


def test_what_is_not_offered_is_not_there(client: httpx.Client) -> None:
    """An unknown name is told with a sentence, also where an experiment offers nothing of its own."""
    session = begin(client, experiment="sine")
    assert [one["name"] for one in session["exports"]] == [one.name for one in FORMATS]
    answer = client.get(f"/api/v1/sessions/{session['id']}/exports/face-obj")
    assert error_of(answer, 404)["message"] == "The session has no such export."
