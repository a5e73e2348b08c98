"""A package whose experiment does not run, or draws nonsense, harms its own sessions only."""

import json

import httpx
from websockets.sync.client import connect

from tests.browser.host import Server
from tests.server.drawings import decode
from tests.server.host import error_of


def test_an_experiment_that_does_not_run(beside_misbehaving: Server) -> None:
    """A session of a failing experiment is refused without the words of the exception, and others run."""
    server = beside_misbehaving
    assert "failing" in [entry["id"] for entry in server.get("experiments")]
    assert {"name": "failing", "package": "a-failing-one 1.0", "problem": ""} in server.get("plugins")
    session = server.start_session(experiment="sine", frames=10)
    server.seek(session["id"], 9)
    assert len(server.column(session["id"], "estimate")) == 10
    answer = httpx.post(f"{server.url}/api/v1/sessions", json={"recipe": {"experiment": "failing"}}, timeout=60)
    message = error_of(answer, answer.status_code)["message"]
    assert "RuntimeError" in message
    assert "no scene" not in message


def test_an_experiment_that_draws_nonsense(beside_misbehaving: Server) -> None:
    """A primitive with NaN is left out of the drawing, whose caption reports it; the run continues."""
    server = beside_misbehaving
    session = server.start_session(experiment="scribbling", frames=10)["id"]
    address = f"{server.url.replace('http', 'ws', 1)}/api/v1/sessions/{session}/stream?paints=true&has_picture=true"
    with connect(address, max_size=None) as socket:
        frame, drawing, pictures = decode(socket.recv(timeout=30))
        assert "now" in drawing.primitives
        server.seek(session, 5)
        painted = 0
        while frame < 5:
            painted += 1
            socket.send(json.dumps({"type": "painted", "count": painted}))
            frame, drawing, pictures = decode(socket.recv(timeout=30), pictures)
    assert "now" not in drawing.primitives
    assert drawing.primitives
    assert drawing.caption.startswith("Left out of the drawing: now: width must be a finite number")
    assert httpx.get(f"{server.url}/api/v1/sessions/{session}/frame.png", timeout=30).is_success
    server.seek(session, 9)
    assert len(server.column(session, "estimate")) == 10
