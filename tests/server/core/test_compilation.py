"""A server that compiles while it runs: it answers at once, says how far it is, and starts what is ready."""

import asyncio
import threading
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest.mock import Mock, call

import httpx
import pytest

import pftrack_server.core.compilation
from pftrack.doctor.warming import Progress
from pftrack_server.core.compilation import Compilation
from pftrack_server.core.errors import ApiError
from pftrack_server.core.settings import Settings
from tests.apart import run
from tests.server.host import running
from tests.session_requests import session_request
from tests.waiting import wait_for

COURSE = "api/v1/failures/sample-impoverishment/course"
"""It is computed with an experiment that is not compiled yet."""


class Pretended:
    """Compiling that continues when the test says so."""

    def __init__(self, names: list[str], told: object) -> None:
        self.names, self.told = names, told
        self.progress = Progress(14, 41, left_s=40.5)
        self.stop, self.prefer = Mock(), Mock()

    def goes_on(self, progress: Progress) -> None:
        self.progress = progress
        self.told(progress)


@pytest.fixture
def warming(monkeypatch: pytest.MonkeyPatch) -> list[Pretended]:
    made: list[Pretended] = []

    def begin(names: list[str], told: object) -> Pretended:
        made.append(Pretended(names, told))
        return made[0]

    monkeypatch.setattr(pftrack_server.core.compilation, "Warming", begin)
    monkeypatch.setattr(pftrack_server.core.compilation, "ready", lambda names: frozenset({"ball"}))
    monkeypatch.setattr(pftrack_server.core.compilation, "PATIENCE_S", 0.2)
    return made


@pytest.fixture
def client(warming: list[Pretended], tmp_path: Path) -> Iterator[httpx.Client]:
    with running(Settings(data_dir=tmp_path)) as host, httpx.Client(base_url=host.url, timeout=60) as http:
        yield http
    warming[0].stop.assert_called()


def start(client: httpx.Client, experiment: str) -> httpx.Response:
    return client.post("/api/v1/sessions", json=session_request({"recipe": {"experiment": experiment}}))


def test_a_server_is_there_while_it_compiles(client: httpx.Client, warming: list[Pretended]) -> None:
    """It is alive, not ready, and says what is done and left; what is compiled starts, what is not says how long."""
    assert client.get("/healthz").status_code == 200
    answer = client.get("/readyz")
    sentence = "compiling, 14 of 41 functions, about 40 s on an idle machine, only once"
    assert answer.status_code == 503
    assert answer.json()["error"]["message"] == f"The server is not ready: {sentence}."
    told = client.get("/api/v1/compilation").json()
    expected = {"finished": False, "done": 14, "total": 41, "sentence": sentence, "ready": ["ball"]}
    assert {name: told[name] for name in expected} == expected
    refused = start(client, "sine")
    assert refused.status_code == 503
    assert sentence in refused.json()["error"]["message"]
    assert client.get("/api/v1/experiments/sine/thumbnail.webp").status_code == 200  # it came with the program
    assert client.get(COURSE).status_code == 503
    assert start(client, "ball").status_code == 201
    assert warming[0].names[:2] == ["histogram", "fish"]  # in the order of the start page
    assert warming[0].prefer.mock_calls == [call("sine")]  # opened; of others a picture was shown
    warming[0].goes_on(Progress(40, 41, usable=frozenset({"sine"})))
    told = client.get("/api/v1/compilation").json()
    assert (told["usable"], told["ready"]) == (["ball", "sine"], ["ball"])
    assert start(client, "sine").status_code == 201  # what it is by default is compiled
    warming[0].goes_on(Progress(41, 41, ready=frozenset(warming[0].names), finished=True))
    assert client.get("/readyz").status_code == 200
    assert client.get("/api/v1/compilation").json()["finished"]


def test_a_waiting_class_delays_no_other_request(
    client: httpx.Client, warming: list[Pretended], monkeypatch: pytest.MonkeyPatch
) -> None:
    """While many wait for one experiment, ready ones start, and then all get theirs."""
    monkeypatch.setattr(pftrack_server.core.compilation, "PATIENCE_S", 60.0)
    with ThreadPoolExecutor(50) as pool:
        waiting = [pool.submit(client.get, COURSE, timeout=300) for _ in range(50)]
        wait_for(lambda: all(each.running() for each in waiting))
        assert start(client, "ball").status_code == 201
        assert not any(each.done() for each in waiting)
        warming[0].goes_on(Progress(41, 41, ready=frozenset(warming[0].names), finished=True))
        assert {each.result().status_code for each in waiting} == {200}


async def test_waiting_requests_end_when_the_server_stops(warming: list[Pretended]) -> None:
    """At once, so that the server does not have to wait for them."""
    stopping = threading.Event()
    compilation = Compilation(("sine",), frozenset(), stopping)
    assert warming[0].prefer.mock_calls == [call("sine")]  # all of the first, whose tour is offered, before the others
    waiting = asyncio.ensure_future(compilation.wait_for("sine"))
    stopping.set()
    with pytest.raises(ApiError, match="is shutting down"):
        await waiting


def test_news_wait_for_nobody_who_looks(warming: list[Pretended], monkeypatch: pytest.MonkeyPatch) -> None:
    """News are told under the lock that a look takes: if they waited for those who look, both would wait for ever."""
    looks, told = threading.Event(), threading.Event()

    def progress(_: Pretended) -> Progress:
        looks.set()
        assert told.wait(30)
        return Progress(finished=True, ready=frozenset({"sine"}))

    monkeypatch.setattr(Pretended, "progress", property(progress, lambda *_: None), raising=False)
    compilation = Compilation(("sine",), frozenset(), threading.Event())
    with ThreadPoolExecutor(2) as pool:
        waiting = pool.submit(lambda: run(compilation.wait_for("sine")))
        assert looks.wait(30)
        telling = pool.submit(warming[0].told, Progress(done=1, total=2))
        try:
            telling.result(10)
        finally:
            told.set()
        waiting.result(30)


def test_what_is_compiled_or_cannot_be_is_let_through(warming: list[Pretended]) -> None:
    """On every start but the first nothing is started, and everything is ready at once.

    An experiment that fails to run is let through, so that its session tells what is wrong.
    """
    compilation = Compilation(("ball",), frozenset({"ball"}), threading.Event())
    assert (warming, compilation.progress.finished) == ([], True)
    run(compilation.wait_for("ball"))
    compilation = Compilation(("ball", "broken"), frozenset({"ball"}), threading.Event())
    assert warming[0].names == ["broken"]
    warming[0].goes_on(Progress(failed={"broken": "ValueError: no"}, finished=True))
    run(compilation.wait_for("broken"))
