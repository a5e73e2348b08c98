"""Truth of an upload: a table of poses or boxes that is given to it, measures what begins from then on, and is kept."""

from collections.abc import Iterator
from typing import Any

import httpx
import pytest

from tests.server.host import begin, error_of, steer
from tests.server.uploads.test_faces import FRAMES, poses, put, put_truth
from tests.server.uploads.test_faces import clip as clip  # noqa: PLC0414 - a fixture
from tests.server.uploads.test_faces import known as known  # noqa: PLC0414 - a fixture
from tests.server.uploads.test_faces import shown as shown  # noqa: PLC0414 - a fixture
from tests.server.work.test_runs import save


@pytest.fixture
def judged(client: httpx.Client, known: str) -> Iterator[str]:
    """The clip as an upload that has no truth, neither before nor after the test."""
    yield known
    for experiment in ("head", "ball"):
        client.delete(f"/api/v1/uploads/{known}/truth", params={"experiment": experiment})


class TestTruth:
    def test_poses_measure_a_session(self, client: httpx.Client, judged: str) -> None:
        """A table of poses is told in short, measures what begins from then on, and can be forgotten."""
        path = f"/api/v1/uploads/{judged}/truth?experiment=head"
        assert client.get(path).json() is None
        given = put_truth(client, judged, poses()).json()
        assert given == {"frames": FRAMES, "first": 0, "last": FRAMES - 1, "warnings": []}
        assert client.get(path).json() == given
        session = begin(client, experiment="head", upload=judged)
        steer(client, session["id"], "seek", frame=FRAMES - 1)
        errors = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]["error"]
        assert errors[0] == pytest.approx(0, abs=1e-6)
        assert 0 < max(errors) < 10
        assert client.delete(path).status_code == 204
        assert client.get(path).json() is None

    def test_boxes_measure_a_ball(self, client: httpx.Client, judged: str) -> None:
        """The kind of truth is that of the experiment."""
        answer = put_truth(client, judged, "frame,x,y,w,h\n0,10,20,10,10\n1,11,20,10,10\n", "ball")
        assert answer.json()["frames"] == 2
        assert client.get(f"/api/v1/uploads/{judged}/truth?experiment=head").json() is None
        session = begin(client, upload=judged, box=[10, 20, 10, 10])
        errors = client.get(f"/api/v1/sessions/{session['id']}/diagnostics").json()["columns"]["error"]
        assert errors[0] is not None
        steer(client, session["id"], "seek", frame=1)
        saved = save(client, session["id"])
        inside = saved["summary"]["inside_share"]
        assert saved["summary"]["success_measure"] == "inside_share"
        assert saved["outcome"] == f"{100 * inside:.0f} % inside the true box, 2 frames in all"

    @pytest.mark.parametrize(
        ("text", "words"),
        [
            ("", "The file, line 1: expected the columns frame, yaw_deg, pitch_deg, roll_deg"),
            ("frame,yaw_deg,pitch_deg,roll_deg\n0,1,left,3\n", "line 2: pitch_deg must be a number of degrees"),
            ("frame,yaw_deg,pitch_deg,roll_deg\n900,1,2,3\n", "0 to 11; the file begins at frame 900"),
            ("\x00\x01", "The file"),
        ],
    )
    def test_what_is_no_truth(self, client: httpx.Client, judged: str, text: str, words: str) -> None:
        """A table that cannot be used is refused with its line and what is allowed, and what was there stays."""
        put_truth(client, judged, poses())
        assert words in error_of(put_truth(client, judged, text), 422)["message"]
        assert client.get(f"/api/v1/uploads/{judged}/truth?experiment=head").json()["frames"] == FRAMES

    def test_an_upload_that_was_deleted_meanwhile(self, start_server: Any, clip: bytes) -> None:
        """Where the upload has gone while its table was read, nothing is kept, and that is said."""
        with start_server() as (server, client):
            upload = put(client, clip)["id"]
            files = server.app.state.services.store.files
            files.remove("uploads", upload)
            assert "deleted" in error_of(put_truth(client, upload, poses()), 409)["message"]
            assert not files.truth(upload, "poses").parent.exists()
