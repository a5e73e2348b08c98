"""Roles: all that owner and follower of a class may request here; what is not in these lists is refused.

An entry is the method, or `WS` for a websocket, and the path as the app's own routes have it. A placeholder with the
name of a field of `Reach` stands for one of the names in that field only; any other stands for anything.
"""

import re
from typing import Final, Literal, NamedTuple

from starlette.routing import compile_path

from pftrack_server.teaching.links import Role

Standing = Role | Literal["stranger"]
"""A role, or that of a browser that has a follower's link and no seat yet."""

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
    # Each is drawn anew, by the worker that computes the run.
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
    """What somebody may name in an address.

    Attributes:
        seen: Sessions to look at.
        steered: Sessions to do with as one likes, all of them seen as well.
        lessons: Lessons that are followed.
        tried: Those of them whose figures may be turned by oneself.
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
        """Tell whether a request is one of these."""
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
    """Tell whether somebody may ask for this.

    Args:
        role: By the link.
        reach: What the link stands for at the moment.
        method: Of the request, or `WS` for a websocket.
        path: As the app's routes have it.
    """
    return any(rule.allows(method, path, reach) for rule in RULES[role])
