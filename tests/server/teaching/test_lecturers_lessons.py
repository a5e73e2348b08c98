"""A lecturer's lesson on a server: a file in the data directory, listed, asked, judged and checked as any other."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx

from pftrack.teaching.lessons.lesson import answer_of
from pftrack.teaching.lessons.library import read_lesson
from tests.server.host import error_of
from tests.waiting import wait_for

URL = "/api/v1/lessons"

MINE = """---
id: mine
title: A signal in noise
experiment: sine
frames: 12
unlocked: [seed]
question:
  text: How far off is the estimate on average?
  tolerance: 0.01
  bounds: [0, 100]
  words: That is how much noise there is.
  mistakes:
    - {given: 0, words: There is noise.}
answer: mean_error
tries: [Draw another seed.]
notice: The estimate lags.
---
A signal is measured in noise.
"""
BROKEN = MINE.replace("id: mine", "id: broken").replace("seed]", "sead]")
NOTHING = MINE.replace("id: mine", "id: nothing").replace(
    "  tolerance: 0.01\n  bounds: [0, 100]\n", "  kind: choice\n  choices: {near: It is near, far: It is far}\n"
)
NOTHING = NOTHING.replace("{given: 0,", "{given: far,").replace(
    "answer: mean_error", "answer: {measure: mean_error, choices: {near: 900, far: 1000}}"
)


def answered(client: httpx.Client, lesson: str, answer: object) -> httpx.Response:
    """What is said of an answer once the run that it is judged by has been computed."""

    def said() -> httpx.Response | None:
        got = client.post(f"{URL}/{lesson}/answer", json={"answer": answer})
        return None if got.status_code == 202 else got

    found = wait_for(said, what="the run is computed")
    assert found is not None
    return found


def checked(client: httpx.Client, lesson: str) -> dict[str, Any]:
    """The one check of a lecturer's lesson, once it has been computed."""

    def results() -> list[dict[str, Any]]:
        told = client.get(f"{URL}/{lesson}/checks").json()
        return told["results"] if told["done"] == told["total"] else []

    (result,) = wait_for(results, what="the check is computed")
    return result


def test_a_file_in_the_data_directory_is_a_lesson(start_server: Callable[..., Any], tmp_path: Path) -> None:
    """It is listed beside the course, judged by its run and checked; what is wrong with others is told by line."""
    folder = tmp_path / "data" / "lessons"
    folder.mkdir(parents=True)
    endless = MINE.replace("frames: 12", f"frames: 0x{'f' * 5000}")
    for name, text in (("mine", MINE), ("broken", BROKEN), ("nothing", NOTHING), ("endless", endless)):
        (folder / f"{name}.md").write_text(text, encoding="utf-8")
    with start_server() as (_, client):
        listed = client.get(URL).json()
        assert {"mine", "nothing", "colour"} <= {it["id"] for it in listed["lessons"]}
        problem, large = listed["problems"]
        assert (large["origin"], large["line"]) == ("endless.md", 5)
        assert (problem["origin"], problem["line"]) == ("broken.md", 6)
        assert "did you mean seed?" in problem["message"]
        right = answer_of(read_lesson(MINE)).exact
        said = answered(client, "mine", right).json()
        assert said["right"]
        assert not answered(client, "mine", 50).json()["right"]
        assert checked(client, "mine")["passed"]
        beyond = "below the lowest number of every choice"
        assert beyond in error_of(answered(client, "nothing", "near"), 422)["message"]
        failed = checked(client, "nothing")
        assert not failed["passed"]
        assert beyond in failed["problem"]
        # A file that was mended is another lesson: what was computed of it before does not count.
        (folder / "nothing.md").write_text(NOTHING.replace("near: 900", "near: 0"), encoding="utf-8")
        assert checked(client, "nothing")["passed"]
