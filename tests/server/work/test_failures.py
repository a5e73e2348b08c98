"""The gallery of failures over REST."""

from pathlib import Path

import httpx
import pytest

from pftrack.analysis.failures import gallery
from pftrack.experiments import EXPERIMENTS
from pftrack_server.jobs.functions import FailureResult, run_with_and_without_cure
from pftrack_server.jobs.results import DiskCache, ExperimentResults
from tests.apart import run
from tests.server.host import Server
from tests.session_requests import session_request


def test_failures_are_listed_with_both_recipes(client: httpx.Client) -> None:
    """Each has number, kind, diagnosis and cure in words, and two recipes of one seed to be started as they are."""
    listed = client.get("/api/v1/failures").json()
    assert [(it["number"], it["id"]) for it in listed] == [(it.number, it.failure.id) for it in gallery(EXPERIMENTS)]
    for it in listed:
        assert it["failing"]["seed"] == it["cured"]["seed"]
        assert it["failing"]["experiment"] == it["cured"]["experiment"] == it["experiment"]
        assert it["differences"]
        assert it["page"] == f"failures/{it['id']}"
    body = {"recipe": listed[3]["failing"], "position": 3}
    started = client.post("/api/v1/sessions", json=session_request(body))
    assert started.status_code == 201, started.text
    assert started.json()["frames"] == listed[3]["failing"]["frames"]


def test_a_failure_says_what_its_cure_changes(client: httpx.Client) -> None:
    """Only what differs is listed, in the words of the experiment: a parameter, or the tracker."""
    by_name, by_number = (client.get(f"/api/v1/failures/{name}").json() for name in ("overconfident-weights", 4))
    assert by_name["differences"] == [{"title": "Sharpness lambda", "unit": "", "failing": 200, "cured": 20}]
    tracker = {"title": "Tracker", "unit": "", "failing": "Guided diffusion", "cured": "Condensation"}
    assert (by_number["id"], by_number["differences"]) == ("wrong-dynamics", [tracker])


def test_what_its_runs_come_to_is_computed_here(client: httpx.Client, server: Server) -> None:
    """The course has an error and a verdict for each frame of both runs, and what shows the failure in them.

    It is computed once: another start of the server has it from the disk.
    """
    course = client.get("/api/v1/failures/4/course").json()
    failing, cured = course["failing"], course["cured"]
    assert course["unit"] == "px"
    assert len(failing["errors"]) == len(cured["lost"]) == 60
    assert (failing["shown"], cured["shown"]) == (True, False)
    assert (failing["lost"][6], failing["lost"][7]) == (False, True)
    assert not any(cured["lost"])
    assert f"{failing['numbers']['believed']:.1f} px" in failing["finding"]
    assert cured["finding"] == "Never lost in 60 frames."
    assert course["frame"] == 7
    error = next(it for it in course["measured"] if it["title"] == "distance from the truth")
    assert error["failing"] > 10 * error["cured"]
    assert client.get("/api/v1/failures/wrong-dynamics/course").json() == course

    async def would_compute(name: str) -> None:
        raise AssertionError(f"{name} is computed again")

    services = server.app.state.services
    cache = DiskCache(services.settings.data_dir / "experiments-computed")
    again = ExperimentResults(cache, services.tasks, would_compute)
    kept = run(again.get("ball", run_with_and_without_cure, "wrong-dynamics"))
    assert FailureResult.model_validate(kept).model_dump(mode="json") == course


def test_what_another_program_has_computed_is_forgotten(tmp_path: Path) -> None:
    """Results are read as they were written; those of another version, and what is damaged, are not there."""
    kept = DiskCache(tmp_path)
    kept.write("one", {"value": 1.5})
    kept.write("two", {})
    (folder,) = tmp_path.iterdir()
    (folder / "two").write_text("no JSON")
    (tmp_path / "another").mkdir()
    kept = DiskCache(tmp_path)
    assert kept.read("one") == {"value": 1.5}
    assert kept.read("two") is kept.read("three") is None
    assert list(tmp_path.iterdir()) == [folder]


@pytest.mark.parametrize("name", ["11", "0", "look-alike", "-1", "%20"])
def test_an_unknown_failure_is_told_in_words(client: httpx.Client, name: str) -> None:
    """What is not there is answered with 404, what was asked for, and how many there are."""
    for path in (name, f"{name}/course"):
        answer = client.get(f"/api/v1/failures/{path}")
        assert answer.status_code == 404
        assert "It may belong to an experiment that is not installed; there are 10" in answer.json()["error"]["message"]
