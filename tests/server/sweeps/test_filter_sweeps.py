"""Sweeps of a filter file of the server's owner, a tracker like any other, with the numbers of the library."""

from pathlib import Path
from typing import Any

import httpx
import pytest

import pftrack
from pftrack.experiments import find
from tests.server.host import error_of
from tests.server.store.test_filters import TEXT
from tests.server.store.test_filters import client as client  # noqa: PLC0414 - a fixture
from tests.server.store.test_filters import file as file  # noqa: PLC0414 - a fixture
from tests.server.sweeping import rows, until_state

SMALL: dict[str, Any] = {
    "experiment": "ball",
    "axes": [{"name": "occlusion_width_px", "values": [5, 55]}],
    "trackers": ["mine", "condensation"],
    "trials": 2,
    "frames": 12,
    "seed": 3,
    "parameters": {"sample_count": 100},
}


def test_a_file_is_a_tracker_of_a_sweep(client: httpx.Client, file: Path) -> None:
    """Its runs have the library's numbers, are downloaded as files, and open as sessions of the file's first text."""
    size = client.post("/api/v1/sweeps/estimate", json={**SMALL, "measure": False}).json()
    assert (size["runs"], size["problem"]) == (8, None)
    begun = client.post("/api/v1/sweeps", json=SMALL).json()
    assert [each["title"] for each in begun["trackers"]] == ["mine.py", find("ball").trackers["condensation"].title]
    file.write_text(TEXT.replace("noise_px: float = 3.0", "noise_px: float = 9.0"))
    told = until_state(client, begun["id"], "done")
    assert (told["done"], told["problems"]) == (8, 0)

    row = next(each for each in rows(client, begun["id"], x="occlusion_width_px")["rows"] if each["tracker"] == "mine")
    opened = client.post(f"/api/v1/sweeps/{begun['id']}/rows/{row['run']}/open").json()
    assert (opened["tracker"], opened["parameters"]["noise_px"]) == ("mine", 3.0)
    path = file.with_name("elsewhere") / "mine.py"
    path.parent.mkdir()
    path.write_text(TEXT)
    values = {"occlusion_width_px": 5, "sample_count": 100}
    run = pftrack.run("ball", tracker=str(path), seed=row["seed"], frames=12, **values)
    assert run.summary().verdict.mean_error == pytest.approx(row["mean_error"])

    table = client.get(f"/api/v1/sweeps/{begun['id']}/download", params={"format": "csv"}).text
    assert table.count(',"mine",') == 4


def test_a_mistake_is_reported_with_its_line(client: httpx.Client, file: Path) -> None:
    """A file that cannot be read refuses the sweep; a mistake in a step is the problem of its runs alone.

    The text of a filter in a request is refused.
    """
    assert client.post("/api/v1/sweeps", json={**SMALL, "filters": {"theirs": [TEXT]}}).status_code == 422
    file.write_text(TEXT + "def broken(:\n")
    refused = error_of(client.post("/api/v1/sweeps", json=SMALL), 422)
    assert refused["field"] == "trackers"
    assert f"mine.py, line {len(TEXT.splitlines()) + 1}" in refused["message"]

    file.write_text(TEXT.replace("return np.log(0.02", "return np.log(-0.5"))
    begun = client.post("/api/v1/sweeps", json=SMALL).json()
    assert until_state(client, begun["id"], "done")["problems"] == 4
    line = TEXT[: TEXT.index("def log_likelihood")].count("\n") + 1
    problems = {each["tracker"]: each["problem"] for each in rows(client, begun["id"])["rows"]}
    assert problems["condensation"] is None
    assert f"mine.py, line {line}" in problems["mine"]
