"""The REST interface under random requests: each answer is one that the interface describes."""

from typing import Any

import httpx
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from pftrack_server.core.settings import Settings
from tests.experiments.head.heads import film, pictures
from tests.server.host import Server, begin, running, steer
from tests.server.sweeping import begin_sweep, until_state
from tests.server.uploads.test_uploads import send

OPERATIONS = [
    ("POST", "/api/v1/sessions"),
    ("POST", "/api/v1/sessions/{session}/commands"),
    ("GET", "/api/v1/sessions/{session}/diagnostics"),
    ("POST", "/api/v1/sessions/{session}/bookmarks"),
    ("POST", "/api/v1/runs"),
    ("GET", "/api/v1/uploads/{upload}/frames/{frame}.jpg"),
    ("GET", "/api/v1/uploads/{upload}/mark"),
    ("GET", "/api/v1/uploads/{upload}/suitability"),
    ("PUT", "/api/v1/uploads/{upload}/truth"),
    ("POST", "/api/v1/uploads"),
    ("POST", "/api/v1/runs/import"),
    ("POST", "/api/v1/sweeps"),
    ("POST", "/api/v1/sweeps/estimate"),
    ("GET", "/api/v1/sweeps/{sweep}/cells"),
    ("GET", "/api/v1/sweeps/{sweep}/rows"),
    ("POST", "/api/v1/sweeps/{sweep}/rows/{run}/open"),
    ("POST", "/api/v1/lectures"),
    ("POST", "/api/v1/lectures/import"),
    ("PUT", "/api/v1/lectures/{lecture}"),
    ("PUT", "/api/v1/follows/{follow}/poll"),
    ("GET", "/api/v1/polls"),
]
"""Operations with a body, a query or a number in the path."""

QUICKLY = settings(
    max_examples=40, deadline=None, database=None, phases=[Phase.generate], suppress_health_check=list(HealthCheck)
)


@pytest.fixture(scope="module")
def fuzzed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A server whose limits are small, so that no example takes long."""
    settings = {"max_frames": 300, "max_particles": 1000, "max_sessions": 4, "max_branches": 1000, "sweep_jobs": 1}
    with running(Settings(data_dir=tmp_path_factory.mktemp("fuzzed"), **settings)) as server:
        yield server


@pytest.fixture(scope="module")
def made(fuzzed: Server) -> dict[str, Any]:
    """A sweep that is complete, and a clip of a face."""
    with httpx.Client(base_url=fuzzed.url, timeout=60) as client:
        sweep = until_state(client, begin_sweep(client)["id"], "done")["id"]
        upload = send(client, ("face.mp4", film(pictures(3, width=320)))).json()["id"]
    return {"sweep": sweep, "run": 1, "upload": upload}


@pytest.mark.slow
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize(("method", "path"), OPERATIONS)
def test_made_up_requests(fuzzed: Server, made: dict[str, Any], method: str, path: str) -> None:
    """Random requests, right and wrong ones, are answered as the interface describes, and never with a 500."""
    import schemathesis  # here, since collecting tests should not take a second longer
    from schemathesis import GenerationMode, checks

    promised = [checks.not_a_server_error, checks.content_type_conformance, checks.response_schema_conformance]
    schema = schemathesis.openapi.from_url(f"{fuzzed.url}/openapi.json")
    with httpx.Client(base_url=fuzzed.url, timeout=60) as client:
        session = begin(client)
        follow = client.post("/api/v1/follows", json={"lesson": "bayes"}).json()
        lecture = client.post("/api/v1/lectures", json={"title": "Any"}).json()
        kept = {"follow": follow["id"], "lecture": lecture["id"]}
        real = {"session": session["id"], "experiment": "ball", "branch": "b0", **made, **kept}
        operation = schema[path][method]
        # schemathesis makes the pairs of a mapping's values a schema of an older draft, which it then refuses.
        looked_at = promised[:2] if path.endswith("/mark") else promised
        cases = st.one_of(operation.as_strategy(), operation.as_strategy(generation_mode=GenerationMode.NEGATIVE))

        @QUICKLY
        @given(cases, st.booleans())
        def check(case: Any, exists: bool) -> None:
            if exists:
                known = {name: value for name, value in real.items() if name in (case.path_parameters or {})}
                case.path_parameters = {**(case.path_parameters or {}), **known}
                if "experiment" in (case.query or {}):
                    case.query = {**case.query, "experiment": "head"}
            response = case.call(base_url=fuzzed.url)
            case.validate_response(response, checks=looked_at)
            if response.status_code >= 400:
                assert set(response.json()) == {"error"}
            if response.status_code == 201 and path.endswith(("/open", "/sweeps", "/sessions")):
                kind = "sweeps" if path.endswith("/sweeps") else "sessions"
                client.delete(f"/api/v1/{kind}/{response.json()['id']}")

        check()
        client.delete(f"/api/v1/follows/{follow['id']}")
        assert steer(client, session["id"], "pause")["playing"] is False
        client.delete(f"/api/v1/sessions/{session['id']}")
