"""Lessons through the REST interface: what there is, what is shown, what is said of an answer, and what is checked."""

import asyncio
import json
from dataclasses import replace
from typing import Any

import httpx
import numba
import pytest

from pftrack.doctor import compiling
from pftrack.process import calls
from pftrack.teaching.lessons import LESSONS
from pftrack.teaching.lessons.lesson import Demonstration
from pftrack_server.teaching import functions
from pftrack_server.teaching.lessons import Lessons
from tests.server.host import Server, error_of
from tests.waiting import wait_for

URL = "/api/v1/lessons"
DEMONSTRATIONS = [name for name, lesson in LESSONS.items() if isinstance(lesson.body, Demonstration)]


def figure(client: httpx.Client, lesson: str, **wanted: Any) -> dict[str, Any]:
    answer = client.post(f"{URL}/{lesson}/figure", json=wanted)
    assert answer.status_code == 200, answer.text
    return answer.json()


def traces(shown: dict[str, Any]) -> list[dict[str, Any]]:
    return [trace for panel in shown["figure"]["panels"] for trace in panel["traces"]]


def test_all_lessons_are_listed_in_the_order_of_the_course(client: httpx.Client) -> None:
    """Those of the course come first; each says what it checks and where its idea is used."""
    listed = client.get(URL).json()
    course = [lesson for lesson in listed["lessons"] if lesson["number"]]
    assert [lesson["id"] for lesson in course] == list(LESSONS)
    assert [lesson["number"] for lesson in course] == sorted(lesson["number"] for lesson in course)
    assert all(lesson["problem"] is None for lesson in course)
    assert {check["name"] for check in course[0]["checks"]} == {check.name for check in LESSONS["probability"].checks}
    assert listed["problems"] == []


@pytest.mark.parametrize("name", LESSONS)
def test_a_lesson_tells_all_but_its_answer(client: httpx.Client, name: str) -> None:
    """Texts are HTML, every formula could be read, every parameter has a control, and nothing gives the answer away."""
    lesson = LESSONS[name]
    told = client.get(f"{URL}/{name}").json()
    assert told == client.get(f"{URL}/{lesson.number}").json()
    assert 'class="unread"' not in json.dumps(told)
    assert [each["name"] for each in told["declarations"]] == list(told["defaults"])
    assert set(told["question"]) == {"text", "kind", "unit", "bounds", "choices", "panel", "along"}
    assert told["notice"]
    assert (told["scenario"] is None) == isinstance(lesson.body, Demonstration)
    neighbours = [told["previous"], told["next"]]
    assert all(each is None or each["id"] != name for each in neighbours)


@pytest.mark.parametrize("name", DEMONSTRATIONS)
def test_the_veil_hides_what_answers_the_question(client: httpx.Client, name: str) -> None:
    """Before the answer, the figure at the question's values lacks what reveals it; after it, it is the library's."""
    lesson = LESSONS[name]
    veiled, open_ = figure(client, name), figure(client, name, revealed=True)
    told = client.get(f"{URL}/{name}").json()
    assert veiled["parameters"] == told["asked"]
    assert open_["parameters"] == told["defaults"]
    assert not [trace for trace in traces(veiled) if trace["reveals"]]
    body = lesson.body
    assert isinstance(body, Demonstration)
    shown = body.show(body.parameters, body.seed)
    assert open_["figure"] == shown.figure.model_dump(mode="json")
    assert [number["title"] for number in open_["numbers"]] == [number.title for number in shown.numbers]


def test_a_slider_and_a_seed_change_what_is_shown(client: httpx.Client) -> None:
    """The same seed gives the same figure; another one other draws; another value another figure."""
    first = figure(client, "probability", revealed=True, parameters={"count": 50})
    assert first["parameters"]["count"] == 50
    assert first == figure(client, "probability", revealed=True, parameters={"count": 50})
    assert first["figure"] != figure(client, "probability", revealed=True, parameters={"count": 60})["figure"]
    assert first["figure"] != figure(client, "probability", revealed=True, parameters={"count": 50}, seed=99)["figure"]


def test_what_is_typed_out_of_bounds_is_refused_and_what_is_dragged_there_stops(client: httpx.Client) -> None:
    """A refusal names field, bound and value; a handle cannot be dragged further than the bound."""
    wanted = {"revealed": True, "parameters": {"count": 10**9}}
    refused = error_of(client.post(f"{URL}/probability/figure", json=wanted), 422)
    assert refused["field"] == "count"
    assert "20000" in refused["bound"]
    assert figure(client, "probability", **wanted, nearest=True)["parameters"]["count"] == 20000
    for values in ({"unknown": 1}, {"count": "many"}, {"count": None}):
        error_of(client.post(f"{URL}/probability/figure", json={"parameters": values}), 422)
        error_of(client.post(f"{URL}/probability/figure", json={"parameters": values, "nearest": True}), 422)


def test_answers_are_judged_in_words(client: httpx.Client) -> None:
    """The right answer is right, a usual mistake is explained, any other is refused with what is allowed."""
    right = client.post(f"{URL}/sir/answer", json={"answer": 2}).json()
    assert (right["right"], right["exact"]) == (True, 2)
    wrong = client.post(f"{URL}/9/answer", json={"answer": 4}).json()
    assert not wrong["right"]
    assert wrong["words"][0].startswith("You said 4; it is 2")
    assert len(wrong["words"]) > len(right["words"])
    for nothing in ("half", "", "nan", 1e9, True, None, [2]):
        assert "answer" in error_of(client.post(f"{URL}/sir/answer", json={"answer": nothing}), 422)["field"]
    chosen = LESSONS["bayes"].question
    assert client.post(f"{URL}/bayes/answer", json={"answer": next(iter(chosen.choices or {}))}).status_code == 200
    assert "one of" in error_of(client.post(f"{URL}/bayes/answer", json={"answer": "nobody"}), 422)["bound"]


def test_the_answer_of_a_scenario_comes_from_a_whole_run(client: httpx.Client) -> None:
    """While the run is computed the answer says how far it is; what is not a number is refused before any run."""
    error_of(client.post(f"{URL}/colour/answer", json={"answer": "never"}), 422)

    def judged() -> dict[str, Any] | None:
        answer = client.post(f"{URL}/colour/answer", json={"answer": 92})
        assert answer.status_code in {200, 202}, answer.text
        return answer.json() if answer.status_code == 200 else None

    verdict = wait_for(judged)
    assert verdict["right"]
    assert verdict["frame"] == verdict["exact"], "it is the frame that the question asks for"
    assert error_of(client.post(f"{URL}/colour/figure", json={}), 422)["message"].startswith("This lesson shows a run")


def test_checks_are_computed_once_and_kept(server: Server, client: httpx.Client) -> None:
    """Each check comes with ours, exact and tolerance; the results lie in the data directory under their content."""

    def checked() -> dict[str, Any] | None:
        found: dict[str, Any] = client.get(f"{URL}/bayes/checks").json()
        return found if found["done"] == found["total"] else None

    found = wait_for(checked)
    assert [result["check"] for result in found["results"]] == [check.name for check in LESSONS["bayes"].checks]
    for result in found["results"]:
        assert result["passed"], result
        assert abs(result["ours"] - result["exact"]) <= result["tolerance"]
    folder = server.app.state.services.settings.data_dir / "lessons-computed"
    # All is told before it is written.
    assert wait_for(
        lambda: [path for path in folder.rglob("*") if path.is_file() and b'"results"' in path.read_bytes()]
    )


def test_a_notebook_of_a_lesson_can_be_taken_away(client: httpx.Client) -> None:
    """It is JSON of Jupyter's format under the lesson's name, of a demonstration and of a run."""
    for name in ("bayes", "colour"):
        answer = client.get(f"{URL}/{name}/notebook.ipynb")
        assert f'filename="{name}.ipynb"' in answer.headers["content-disposition"]
        assert answer.json()["nbformat"] == 4


def test_an_unknown_lesson_is_told_with_those_that_there_are(client: httpx.Client) -> None:
    """The interface answers 404 with the list, and so does the page, which a number leads to the lesson's name."""
    assert "9 sir" in error_of(client.get(f"{URL}/nothing"), 404)["message"]
    error_of(client.post(f"{URL}/99/figure", json={}), 404)
    assert client.get("/learn/nothing").status_code == 404
    assert client.get("/learn/9").headers["location"].endswith("/learn/sir")
    assert client.get("/learn/sir").status_code == 200
    assert client.get("/learn").status_code == 200


def test_a_worker_that_compiles_gives_signs_of_life(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not ended as one that takes too long: it tells of a function before and after it is compiled."""
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
