"""The base path: what stands before all addresses of the server, at its root nothing.

A request carries it as ASGI's `root_path`, and its `path` begins with it. Those who come by the link of a class have a
longer one, since the addresses of a class begin with its link. It is kept decoded, without a slash at its end, and is
encoded here alone. Whatever the server says of its own addresses, beside redirections and links that are printed, is
relative to it: `session/1f`, not `/session/1f`. A page carries it once, as its `<base>`.
"""

import re
from collections.abc import Mapping
from typing import Any, Protocol
from urllib.parse import quote, unquote

KEPT = "/@:~!$&'()*+="
"""What stands for itself in a path, beside letters, digits and `-._`; a semicolon would end the path of a cookie."""
LINKS = "/f"
"""Where the addresses of links begin that give rights of their own."""
GUEST = "pftrack.guest"
"""Where the scope of a request has who came by such a link."""
UNFIT = re.compile(r"[\x00-\x1f\x7f\\]")


class Guest(Protocol):
    """Somebody who came by a link, with its rights alone."""

    @property
    def about(self) -> str:
        """Attributes that tell a page's scripts who has come."""

    def may_steer(self, session: str) -> bool:
        """Tell whether a session is the guest's to steer, not only to look at."""


def guest_of(scope: Mapping[str, Any]) -> Guest | None:
    """Return who came by a link; None for somebody with the rights of the whole server."""
    found: Guest | None = scope.get(GUEST)
    return found


def read_base_path(text: str) -> str:
    """Return a base path as it was typed, decoded and without a slash at its end; empty at the root.

    Args:
        text: Such as `/any/prefix` or `/@/space%20word/`.

    Raises:
        ValueError: It is none.
    """
    if text in {"", "/"}:
        return ""
    if not text.startswith("/"):
        raise ValueError(f'a base path begins with "/", as in /any/prefix; got {text!r}')
    if found := next((mark for mark in "?#" if mark in text), None):
        raise ValueError(f'a base path is a path alone, without "{found}"; got {text!r}')
    try:
        parts = [unquote(part, errors="strict") for part in text.removesuffix("/").split("/")[1:]]
    except UnicodeDecodeError:
        raise ValueError(f"a base path is UTF-8 with percent signs, as in /space%20word; got {text!r}") from None
    if {"", ".", ".."} & set(parts):
        raise ValueError(f'a base path has no empty part, no "." and no ".."; got {text!r}')
    if any("/" in part or UNFIT.search(part) for part in parts):
        raise ValueError(f"a base path has no slash within a part, no backslash and no control character; got {text!r}")
    return "".join(f"/{part}" for part in parts)


def encode_path(path: str) -> str:
    """Return a path as addresses have it."""
    return quote(path, safe=KEPT)


def route_path(scope: Mapping[str, Any]) -> str:
    """Return the path of a request as the app's routes have it: without the base."""
    path: str = scope["path"]
    return path.removeprefix(scope.get("root_path", ""))


def address_of(scope: Mapping[str, Any], path: str = "") -> str:
    """Return an address of the server as its client has it, from the slash after the host on.

    Args:
        scope: Of the request.
        path: Relative to the base, encoded.
    """
    return f"{encode_path(scope.get('root_path', ''))}/{path}"
