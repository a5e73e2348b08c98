"""Roles: the requests allowed to owner and follower of a class; all others are refused.

An entry is the method, or `WS` for a websocket, and the path in the app's own routes. A placeholder named after a field
of `Reach` matches only the names in that field; any other placeholder matches anything.
"""

import re
from typing import Final, Literal, NamedTuple

from starlette.routing import compile_path

from pftrack_server.teaching.links import Role

Standing = Role | Literal["stranger"]
"""A role, or `entering`: a browser with a follower's link and no seat yet."""

ENTERING: Final = ("GET /static/{path:path}", "HEAD /static/{path:path}", "GET /viz/client/{name}")
LOOKING: Final = (
    "GET /viz/{seen}/",
    "WS /viz/{seen}",
    "WS /viz/{seen}/",
    "GET /api/v1/sessions/{seen}",
    "GET /api/v1/sessions/{seen}/diagnostics",
    "WS /api/v1/sessions/{seen}/stream",
    "GET /api/v1/lessons/{lessons}",
    "GET /api/v1/experiments/{experiment}",
    "GET /api/v1/glossary",
)
STEERING: Final = (
    "GET /session/{steered}",
    # The worker that computes the run draws each of these again.
    "GET /api/v1/sessions/{steered}/frame.png",
    "GET /api/v1/sessions/{steered}/explanation",
    "DELETE /api/v1/sessions/{steered}",
    "POST /api/v1/sessions/{steered}/commands",
    "POST /api/v1/sessions/{steered}/resume",
    "POST /api/v1/sessions/{steered}/bookmarks",
    "DELETE /api/v1/sessions/{steered}/bookmarks/{bookmark}",
    "GET /learn/{tried}",
    "POST /api/v1/lessons/{tried}/figure",
    "POST /api/v1/lessons/{tried}/answer",
)
ARRIVING: Final = ("GET /follow",)
FOLLOWING: Final = (
    "GET /api/v1/follow",
    "WS /api/v1/follow/stream",
    "PUT /api/v1/follow/vote",
    "POST /api/v1/follow/fork",
    "DELETE /api/v1/follow/fork",
)
LEADING: Final = (
    "GET /api/v1/follows/{led}",
    "PATCH /api/v1/follows/{led}",
    "DELETE /api/v1/follows/{led}",
    "GET /api/v1/follows/{led}/qr.svg",
    "POST /api/v1/follows/{led}/figure",
    "PUT /api/v1/follows/{led}/poll",
    "POST /api/v1/follows/{led}/poll/reveal",
    "DELETE /api/v1/follows/{led}/poll",
    "WS /api/v1/follows/{led}/stream",
)


class Reach(NamedTuple):
    """The names that a participant may use in addresses.

    Attributes:
        seen: Sessions to watch.
        steered: Sessions to control; they are all in `seen`, too.
        lessons: Followed lessons.
        tried: Lessons whose figures the participant may change.
        led: Follows to lead.
    """

    seen: frozenset[str]
    steered: frozenset[str]
    lessons: frozenset[str]
    tried: frozenset[str]
    led: frozenset[str]


class _Rule(NamedTuple):
    method: str
    path: re.Pattern[str]

    def allows(self, method: str, path: str, reach: Reach) -> bool:
        """Return whether the rule allows a request."""
        found = self.path.fullmatch(path) if method == self.method else None
        return found is not None and all(
            value in getattr(reach, name) for name, value in found.groupdict().items() if name in Reach._fields
        )


def _rules(*lists: tuple[str, ...]) -> tuple[_Rule, ...]:
    entries = (entry.split(" ") for entries in lists for entry in entries)
    return tuple(_Rule(method, compile_path(path)[0]) for method, path in entries)


RULES: dict[Standing, tuple[_Rule, ...]] = {
    "stranger": _rules(ENTERING, ARRIVING),
    "follower": _rules(ENTERING, ARRIVING, LOOKING, STEERING, FOLLOWING),
    "owner": _rules(ENTERING, LOOKING, STEERING, LEADING),
}


def is_allowed(role: Standing, reach: Reach, method: str, path: str) -> bool:
    """Return whether a request is allowed.

    Args:
        role: Role by the link.
        reach: Names that the link gives access to now.
        method: Method of the request, or `WS` for a websocket.
        path: Path in the app's routes.
    """
    return any(rule.allows(method, path, reach) for rule in RULES[role])
