"""Files of the frame that is shown: what an experiment declares is listed and can be fetched, and nothing else."""

import json

import httpx
import numpy as np

from pftrack.experiments import find
from pftrack.runs.run import Change, Run
from tests.server.host import begin, error_of, steer

SMALL = {"image_width_px": 320, "feature_noise_px": 3, "face_model": "growing"}


def test_a_session_exports_what_its_experiment_offers(client: httpx.Client) -> None:
    """Each file that is listed comes with its name and type; the points are those of the same run in the library."""
    session = begin(client, experiment="head", parameters=SMALL, seed=1)
    offered = {one["name"]: one for one in session["exports"]}
    assert set(offered) == {one.name for one in find("head").exports}
    steer(client, session["id"], "seek", frame=3)
    for name, one in offered.items():
        answer = client.get(f"/api/v1/sessions/{session['id']}/exports/{name}")
        assert answer.status_code == 200
        assert answer.headers["content-type"].split(";")[0] == one["media_type"]
        assert f'filename="{name}-3.{one["suffix"]}"' in answer.headers["content-disposition"]
        assert len(answer.content) > 500
    said = json.loads(client.get(f"/api/v1/sessions/{session['id']}/exports/face-json").content)
    run = Run(find("head"), find("head").simulate(), seed=1, timeline=(Change(0, SMALL),))
    run.seek(3)
    shape = run.current.state.memory.growth.shape
    np.testing.assert_allclose(list(said["points"].values()), shape, atol=1e-4)
    assert said["frames"] == 3


def test_what_is_not_offered_is_not_there(client: httpx.Client) -> None:
    """An unknown name, and an experiment without exports, are told with a sentence."""
    session = begin(client)
    assert session["exports"] == []
    answer = client.get(f"/api/v1/sessions/{session['id']}/exports/face-obj")
    assert error_of(answer, 404)["message"] == "The session has no such export."
