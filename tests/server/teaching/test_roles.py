"""Roles: what owner and follower may ask for, held against all routes that the app has."""

from typing import Any

import pytest
from fastapi.routing import APIWebSocketRoute, iter_route_contexts
from starlette.routing import Mount

from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings
from pftrack_server.teaching.roles import Reach, is_allowed

REACH = Reach(frozenset({"seen", "own"}), frozenset({"own"}), frozenset({"bayes"}), frozenset(), frozenset())
TRYING = REACH._replace(tried=frozenset({"bayes"}))
LED = Reach(frozenset({"seen"}), frozenset({"seen"}), frozenset({"bayes"}), frozenset({"bayes"}), frozenset({"mine"}))

LOOKING = {
    "GET /viz/client/{name}",
    "GET /viz/{session}/",
    "WS /viz/{session}",
    "WS /viz/{session}/",
    "GET /api/v1/sessions/{session}",
    "GET /api/v1/sessions/{session}/diagnostics",
    "WS /api/v1/sessions/{session}/stream",
    "GET /api/v1/lessons/{lesson}",
    "GET /api/v1/experiments/{experiment}",
    "GET /api/v1/glossary",
    "GET /static",
    "HEAD /static",
}
STEERING = {
    "GET /api/v1/sessions/{session}/frame.png",
    "GET /api/v1/sessions/{session}/explanation",
    "GET /session/{session}",
    "DELETE /api/v1/sessions/{session}",
    "POST /api/v1/sessions/{session}/commands",
    "POST /api/v1/sessions/{session}/resume",
    "POST /api/v1/sessions/{session}/bookmarks",
    "DELETE /api/v1/sessions/{session}/bookmarks/{bookmark}",
}
TURNING = {
    "GET /learn/{lesson}",
    "POST /api/v1/lessons/{lesson}/figure",
    "POST /api/v1/lessons/{lesson}/answer",
}
FOLLOWING = {
    "GET /follow",
    "GET /api/v1/follow",
    "WS /api/v1/follow/stream",
    "PUT /api/v1/follow/vote",
    "POST /api/v1/follow/fork",
    "DELETE /api/v1/follow/fork",
}
LEADING = {
    "GET /api/v1/follows/{follow}",
    "PATCH /api/v1/follows/{follow}",
    "DELETE /api/v1/follows/{follow}",
    "GET /api/v1/follows/{follow}/qr.svg",
    "POST /api/v1/follows/{follow}/figure",
    "PUT /api/v1/follows/{follow}/poll",
    "POST /api/v1/follows/{follow}/poll/reveal",
    "DELETE /api/v1/follows/{follow}/poll",
    "WS /api/v1/follows/{follow}/stream",
}
METHODS = ("GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE")


@pytest.fixture(scope="module")
def routes() -> set[str]:
    """Every route of the app, under every method that there is."""
    found = set()
    for context in iter_route_contexts(create_app(Settings()).routes):
        if isinstance(context.original_route, APIWebSocketRoute):
            found.add(f"WS {context.path}")
        elif not isinstance(context.original_route, Mount) or context.path == "/static":
            found |= {f"{method} {context.path}" for method in METHODS}
    return found


def _allowed(routes: set[str], role: Any, reach: Reach, **names: str) -> set[str]:
    """Return the routes that somebody may ask for who puts these names into their addresses."""
    filled = {"session": "other", "lesson": "other", "follow": "other", **names}

    def may(route: str) -> bool:
        method, path = route.split(" ")
        for name, value in filled.items():
            path = path.replace(f"{{{name}}}", value)
        path = f"{path}/shared/style.css" if path == "/static" else path
        return is_allowed(role, reach, method, path)

    return {route for route in routes if may(route)}


def test_the_walk_sees_the_app(routes: set[str]) -> None:
    """The lists above are of routes that there are."""
    assert routes > LOOKING | STEERING | TURNING | FOLLOWING | LEADING
    assert {"POST /api/v1/sessions", "DELETE /api/v1/runs/{run}", "WS /api/v1/sweeps/{sweep}/stream"} < routes


def test_a_follower_looks_and_does_nothing_else(routes: set[str]) -> None:
    """Of all routes a follower may ask for these, and a route that is new is closed."""
    assert _allowed(routes, "follower", REACH, session="seen", lesson="bayes") == LOOKING | FOLLOWING
    allowed = _allowed(routes, "follower", REACH)
    assert {route for route in allowed if "{session}" in route or "{lesson}" in route} == set()


def test_a_follower_steers_a_fork(routes: set[str]) -> None:
    """A session of the follower's own can be steered, and what is the server's is closed all the same."""
    assert _allowed(routes, "follower", REACH, session="own", lesson="bayes") == LOOKING | FOLLOWING | STEERING


def test_a_follower_turns_the_lesson(routes: set[str]) -> None:
    """A follower who tries the lesson may turn its figure and answer its question."""
    assert _allowed(routes, "follower", TRYING, session="seen", lesson="bayes") == LOOKING | FOLLOWING | TURNING


def test_a_lecturer_leads_one_class(routes: set[str]) -> None:
    """A lecturer's link gives rights over one class and what it follows."""
    allowed = _allowed(routes, "owner", LED, session="seen", lesson="bayes", follow="mine")
    assert allowed == LOOKING | STEERING | TURNING | LEADING
    others = _allowed(routes, "owner", LED)
    assert {route for route in others if any(name in route for name in ("{session}", "{lesson}", "{follow}"))} == set()


def test_a_stranger_gets_the_page_alone(routes: set[str]) -> None:
    """A browser that has no seat yet gets what it needs to come in."""
    allowed = _allowed(routes, "stranger", Reach(*5 * (frozenset(),)), session="seen", lesson="bayes")
    assert allowed == {"GET /follow", "GET /viz/client/{name}", "GET /static", "HEAD /static"}


@pytest.mark.parametrize(
    "path",
    [
        "/api/v1/sessions/seen/../other",
        "/api/v1/sessions/seen/commands/",
        "//api/v1/sessions/seen",
        "/api/v1/sessions/seen/\ncommands",
        "/api/v1/sessions/seen\n",
        "/api/v1/sessions/",
        "/API/v1/sessions/seen",
        "/",
        "",
    ],
)
def test_addresses_that_are_nearly_allowed(path: str) -> None:
    """Followers reach only addresses that the app has."""
    assert not any(is_allowed("follower", REACH, method, path) for method in (*METHODS, "WS"))
