"""Roles: the routes of owner and follower, compared with all routes of the app."""

from functools import reduce
from typing import Any

import pytest
from fastapi.routing import APIWebSocketRoute, iter_route_contexts
from starlette.routing import Mount

from pftrack_server.app import create_app
from pftrack_server.core.settings import Settings
from pftrack_server.teaching.roles import Reach, is_allowed

NOTHING = Reach(*5 * (frozenset(),))
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
TURNING = {"GET /learn/{lesson}", "POST /api/v1/lessons/{lesson}/figure", "POST /api/v1/lessons/{lesson}/answer"}
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
OUTSIDE = {"GET /follow", "GET /viz/client/{name}", "GET /static", "HEAD /static"}
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


def test_the_walk_sees_the_app(routes: set[str]) -> None:
    """The app has all routes of the lists above."""
    assert routes > LOOKING | STEERING | TURNING | FOLLOWING | LEADING | OUTSIDE
    assert {"POST /api/v1/sessions", "DELETE /api/v1/runs/{run}", "WS /api/v1/sweeps/{sweep}/stream"} < routes


@pytest.mark.parametrize(
    ("role", "reach", "session", "allowed"),
    [
        ("follower", REACH, "seen", LOOKING | FOLLOWING),
        ("follower", REACH, "own", LOOKING | FOLLOWING | STEERING),
        ("follower", TRYING, "seen", LOOKING | FOLLOWING | TURNING),
        ("owner", LED, "seen", LOOKING | STEERING | TURNING | LEADING),
        ("stranger", NOTHING, "seen", OUTSIDE),
    ],
)
def test_the_routes_of_a_link(routes: set[str], role: Any, reach: Reach, session: str, allowed: Any) -> None:
    """A follower watches, steers a fork, and changes a lesson's figure of its own; a lecturer's link leads one class.

    A stranger, whose browser has no seat yet, reaches what it needs to enter. A new route is closed, and so is
    everything of other sessions, lessons and classes.
    """

    def reached(session: str, lesson: str, follow: str) -> set[str]:
        filled = {"{session}": session, "{lesson}": lesson, "{follow}": follow, "/static": "/static/shared/style.css"}

        def may(route: str) -> bool:
            method, path = route.split(" ")
            return is_allowed(role, reach, method, reduce(lambda path, pair: path.replace(*pair), filled.items(), path))

        return {route for route in routes if may(route)}

    assert reached(session, "bayes", "mine") == allowed
    of_others = reached("other", "other", "other")
    assert not [route for route in of_others if any(name in route for name in ("{session}", "{lesson}", "{follow}"))]


def test_nearly_allowed_addresses() -> None:
    """An address that differs a little from an allowed one is refused."""
    seen = "/api/v1/sessions/seen"
    near = [f"{seen}{end}" for end in ("/../other", "/commands/", "/\ncommands", "\n")]
    for path in (*near, f"/{seen}", "/api/v1/sessions/", "/API/v1/sessions/seen", "/", ""):
        assert not any(is_allowed("follower", REACH, method, path) for method in (*METHODS, "WS")), path
