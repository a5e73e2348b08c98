"""Lessons through the REST interface: the list, figures, verdicts on answers, and checks."""

import asyncio
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numba
import pytest

from pftrack.doctor import compiling
from pftrack.process import calls
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import Demonstration, answer_of
from pftrack.teaching.lessons.library import read_lesson
from pftrack_server.teaching import functions
from pftrack_server.teaching.lessons import Lessons
from tests.server.host import Server, error_of, post
from tests.teaching.lessons.test_library import GOOD, choosing
from tests.waiting import wait_for

URL = "/api/v1/lessons"


def figure(client: httpx.Client, lesson: str, **wanted: Any) -> dict[str, Any]:
    return dict(post(client, f"lessons/{lesson}/figure", **wanted))


def answered(client: httpx.Client, lesson: str, answer: object) -> httpx.Response:
    """Return the verdict on an answer once the run behind it has been computed."""
    address, said = f"{URL}/{lesson}/answer", {"answer": answer}
    return wait_for(lambda: (it := client.post(address, json=said)).status_code != 202 and it, what="it is computed")


def checked(client: httpx.Client, lesson: str) -> list[dict[str, Any]]:
    """Return the checks of a lesson once they have been computed."""
    told = wait_for(lambda: (it := client.get(f"{URL}/{lesson}/checks").json())["done"] == it["total"] and it)
    return told["results"]


def test_all_lessons_are_listed_in_the_order_of_the_course(client: httpx.Client) -> None:
    """Lessons of the course come first. Texts are HTML with readable formulas, and each parameter has a control."""
    listed = client.get(URL).json()
    course = [lesson for lesson in listed["lessons"] if lesson["number"]]
    assert [lesson["id"] for lesson in course] == list(LESSONS)
    assert [lesson["number"] for lesson in course] == sorted(lesson["number"] for lesson in course)
    assert all(lesson["problem"] is None for lesson in course)
    assert {check["name"] for check in course[0]["checks"]} == {check.name for check in LESSONS["probability"].checks}
    assert listed["problems"] == []
    for name, lesson in LESSONS.items():
        shown = client.get(f"{URL}/{name}").json()
        assert 'class="unread"' not in json.dumps(shown)
        assert [each["name"] for each in shown["declarations"]] == list(shown["defaults"])
        assert set(shown["question"]) == {"text", "kind", "unit", "bounds", "choices", "panel", "along"}
        assert (shown["scenario"] is None) == isinstance(lesson.body, Demonstration)
        assert all(each is None or each["id"] != name for each in (shown["previous"], shown["next"]))
    assert shown == client.get(f"{URL}/{lesson.number}").json()


def test_a_figure_hides_the_answer_until_it_is_given(client: httpx.Client) -> None:
    """Before the answer, the figure at the question's values lacks what reveals it; after it, it is the library's."""
    shown = client.get(f"{URL}/bayes").json()
    body = LESSONS["bayes"].body
    assert isinstance(body, Demonstration)
    veiled, revealed = figure(client, "bayes"), figure(client, "bayes", revealed=True)
    assert (veiled["parameters"], revealed["parameters"]) == (shown["asked"], shown["defaults"])
    assert not [trace for panel in veiled["figure"]["panels"] for trace in panel["traces"] if trace["reveals"]]
    known = body.show(body.parameters, body.seed)
    assert revealed["figure"] == known.figure.model_dump(mode="json")
    assert [number["title"] for number in revealed["numbers"]] == [number.title for number in known.numbers]


def test_a_slider_and_a_seed_change_what_is_shown(client: httpx.Client) -> None:
    """The same seed gives the same figure; another seed or value gives another one.

    A refusal names field, bound and value; a handle cannot be dragged beyond the bound.
    """
    first, again = (figure(client, "probability", revealed=True, parameters={"count": 50}) for _ in range(2))
    assert first["parameters"]["count"] == 50
    assert first == again
    for other in ({"parameters": {"count": 60}}, {"parameters": {"count": 50}, "seed": 99}):
        assert first["figure"] != figure(client, "probability", revealed=True, **other)["figure"]
    wanted = {"revealed": True, "parameters": {"count": 10**9}}
    refused = error_of(client.post(f"{URL}/probability/figure", json=wanted), 422)
    assert refused["field"] == "count"
    assert "20000" in refused["bound"]
    assert figure(client, "probability", **wanted, nearest=True)["parameters"]["count"] == 20000
    for values in ({"unknown": 1}, {"count": "many"}, {"count": None}):
        for nearest in (False, True):
            error_of(client.post(f"{URL}/probability/figure", json={"parameters": values, "nearest": nearest}), 422)


def test_answers_are_judged_in_words(client: httpx.Client) -> None:
    """A right answer is right, a usual mistake is explained, any other text or number is refused with the bounds."""
    right = client.post(f"{URL}/sir/answer", json={"answer": 2}).json()
    assert (right["right"], right["exact"]) == (True, 2)
    wrong = client.post(f"{URL}/9/answer", json={"answer": 4}).json()
    assert not wrong["right"]
    assert wrong["words"][0].startswith("You said 4; it is 2")
    assert len(wrong["words"]) > len(right["words"])
    for nothing in ("half", "nan", 1e9, True, None):
        assert "answer" in error_of(client.post(f"{URL}/sir/answer", json={"answer": nothing}), 422)["field"]
    assert "one of" in error_of(client.post(f"{URL}/bayes/answer", json={"answer": "nobody"}), 422)["bound"]


def test_the_answer_of_a_scenario_comes_from_a_whole_run(client: httpx.Client) -> None:
    """The answer comes with the whole run; what is not a number is refused before any run."""
    error_of(client.post(f"{URL}/colour/answer", json={"answer": "never"}), 422)

    verdict = answered(client, "colour", 92).json()
    assert verdict["right"]
    assert verdict["frame"] == verdict["exact"], "it is the frame that the question asks for"
    assert error_of(client.post(f"{URL}/colour/figure", json={}), 422)["message"].startswith("This lesson shows a run")


def test_checks_are_computed_and_stored(server: Server, client: httpx.Client) -> None:
    """Each check has our value, the exact one and a tolerance; the results are stored in the data directory."""
    results = checked(client, "bayes")
    assert [result["check"] for result in results] == [check.name for check in LESSONS["bayes"].checks]
    for result in results:
        assert result["passed"], result
        assert abs(result["ours"] - result["exact"]) <= result["tolerance"]
    folder = server.app.state.services.settings.data_dir / "lessons-computed"
    # The answer comes before the file is written.
    wait_for(lambda: any(path.is_file() and b'"results"' in path.read_bytes() for path in folder.rglob("*")))


def test_an_unknown_lesson_is_refused_with_the_known_ones(client: httpx.Client) -> None:
    """The interface answers 404 with the list, and so does the page, which a number leads to the lesson's name.

    A notebook of a demonstration or a run is JSON of Jupyter's format under the lesson's name.
    """
    for name in ("bayes", "colour"):
        answer = client.get(f"{URL}/{name}/notebook.ipynb")
        assert f'filename="{name}.ipynb"' in answer.headers["content-disposition"]
        assert answer.json()["nbformat"] == 4
    assert "9 sir" in error_of(client.get(f"{URL}/nothing"), 404)["message"]
    error_of(client.post(f"{URL}/99/figure", json={}), 404)
    assert [client.get(f"/learn{path}").status_code for path in ("/nothing", "/sir", "")] == [404, 200, 200]
    assert client.get("/learn/9").headers["location"].endswith("/learn/sir")


def test_a_worker_that_compiles_gives_signs_of_life(monkeypatch: pytest.MonkeyPatch) -> None:
    """A worker reports a function before and after compiling it, so that it is not ended as too slow."""
    lesson = LESSONS["bayes"]
    assert isinstance(lesson.body, Demonstration)
    show, fresh, told = lesson.body.show, numba.njit(lambda x: x + 1.0), []
    monkeypatch.setattr(compiling, "FUNCTIONS", [fresh])
    monkeypatch.setattr(calls, "_report", told.append)
    compiles = replace(lesson.body, show=lambda parameters, seed: (fresh(1.0), show(parameters, seed))[1])
    monkeypatch.setattr(functions, "find", lambda wanted: replace(lesson, body=compiles))
    functions.draw("bayes", "", {}, None, True, False)
    assert told == [compiling.name_of(fresh)] * 2


def test_a_slow_figure_keeps_nobody_waiting(server: Server, client: httpx.Client) -> None:
    """While two workers of lessons are busy for minutes, a figure and the health of the server are answered."""
    pool = server.app.state.services[Lessons]._pool

    async def slow() -> list[asyncio.Task[Any]]:
        from time import sleep

        return [asyncio.create_task(pool.call(sleep, 600)) for _ in range(2)]

    busy = server.run(slow())
    assert client.get("/healthz").status_code == 200
    assert figure(client, "bayes")["figure"]["panels"]

    async def stop() -> None:
        for task in busy:
            task.cancel()
        await asyncio.gather(*busy, return_exceptions=True)

    server.run(stop())


def test_a_file_in_the_data_directory_is_a_lesson(start_server: Callable[..., Any], tmp_path: Path) -> None:
    """A file is listed beside the course, judged by its run and checked; mistakes in other files name their line."""
    folder = tmp_path / "data" / "lessons"
    folder.mkdir(parents=True)
    endless, broken = GOOD.replace("frames: 12", f"frames: 0x{'f' * 5000}"), GOOD.replace("[tracker,", "[tracer,")
    for name, text in (("mine", GOOD), ("broken", broken), ("nothing", choosing(1000, 900)), ("endless", endless)):
        (folder / f"{name}.md").write_text(text.replace("my-lesson", name), encoding="utf-8")
    with start_server() as (_, client):
        listed = client.get(URL).json()
        assert {"mine", "nothing", "colour"} <= {it["id"] for it in listed["lessons"]}
        problem, large = listed["problems"]
        assert (large["origin"], large["line"]) == ("endless.md", 7)
        assert (problem["origin"], problem["line"]) == ("broken.md", 12)
        assert "did you mean tracker?" in problem["message"]
        right = answer_of(read_lesson(GOOD)).exact
        assert [answered(client, "mine", said).json()["right"] for said in (right, 50)] == [True, False]
        assert [result["passed"] for result in checked(client, "mine")] == [True]
        beyond = "below the lowest number of every choice"
        assert beyond in error_of(answered(client, "nothing", "held"), 422)["message"]
        (failed,) = checked(client, "nothing")
        assert not failed["passed"]
        assert beyond in failed["problem"]
        # A corrected file is another lesson: earlier results do not count.
        (folder / "nothing.md").write_text(choosing(1000, 0).replace("my-lesson", "nothing"), encoding="utf-8")
        assert [result["passed"] for result in checked(client, "nothing")] == [True]
