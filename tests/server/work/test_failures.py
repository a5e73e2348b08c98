"""The gallery of failures over REST."""

from pathlib import Path
from unittest.mock import AsyncMock

import httpx

from pftrack.analysis.failures import gallery
from pftrack.experiments import EXPERIMENTS
from pftrack_server.jobs.functions import FailureResult, run_with_and_without_cure
from pftrack_server.jobs.results import DiskCache, ExperimentResults
from tests.apart import run
from tests.server.host import Server, error_of, post
from tests.session_requests import session_request


def test_failures_are_listed_with_both_recipes(client: httpx.Client) -> None:
    """Each failure has two recipes of one seed, which start as they are, and their difference in words.

    An unknown failure is refused with the number of those that exist.
    """
    listed = client.get("/api/v1/failures").json()
    assert [(it["number"], it["id"]) for it in listed] == [(it.number, it.failure.id) for it in gallery(EXPERIMENTS)]
    for it in listed:
        assert it["failing"]["seed"] == it["cured"]["seed"]
        assert it["failing"]["experiment"] == it["cured"]["experiment"] == it["experiment"]
        assert it["differences"]
        assert it["page"] == f"failures/{it['id']}"
    started = post(client, "sessions", **session_request({"recipe": listed[3]["failing"], "position": 3}))
    assert started["frames"] == listed[3]["failing"]["frames"]
    by_name, by_number = (client.get(f"/api/v1/failures/{name}").json() for name in ("overconfident-weights", 4))
    assert by_name["differences"] == [{"title": "Sharpness lambda", "unit": "", "failing": 200, "cured": 20}]
    tracker = {"title": "Tracker", "unit": "", "failing": "Guided diffusion", "cured": "Condensation"}
    assert (by_number["id"], by_number["differences"]) == ("wrong-dynamics", [tracker])
    for path in ("11", "look-alike", "0/course"):
        message = error_of(client.get(f"/api/v1/failures/{path}"), 404)["message"]
        assert message.endswith("Name one of the 10 failures by its number or name.")


def test_the_course_of_a_failure_is_computed_once(client: httpx.Client, server: Server) -> None:
    """The course has errors and verdicts of both runs, and the measured signs of the failure.

    It is computed once: the server reads it from disk after a restart.
    """
    course = client.get("/api/v1/failures/4/course").json()
    failing, cured = course["failing"], course["cured"]
    assert (course["unit"], course["frame"]) == ("px", 7)
    assert len(failing["errors"]) == len(cured["lost"]) == 60
    assert (failing["shown"], cured["shown"]) == (True, False)
    assert (failing["lost"][6], failing["lost"][7]) == (False, True)
    assert not any(cured["lost"])
    assert f"{failing['numbers']['believed']:.1f} px" in failing["finding"]
    assert cured["finding"] == "Never lost in 60 frames."
    error = next(it for it in course["measured"] if it["title"] == "distance from the truth")
    assert error["failing"] > 10 * error["cured"]
    assert client.get("/api/v1/failures/wrong-dynamics/course").json() == course
    services = server.app.state.services
    cache = DiskCache(services.settings.data_dir / "experiments-computed")
    again = ExperimentResults(cache, services.tasks, AsyncMock(side_effect=AssertionError("it is computed again")))
    kept = run(again.get("ball", run_with_and_without_cure, "wrong-dynamics"))
    assert FailureResult.model_validate(kept).model_dump(mode="json") == course


def test_results_of_another_version_are_deleted(tmp_path: Path) -> None:
    """Results are read as they were written; damaged ones and those of another version are not found."""
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
