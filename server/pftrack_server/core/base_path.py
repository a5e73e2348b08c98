"""The base path: the prefix of all addresses of the server, empty at the root.

A request carries it as ASGI's `root_path`, and its `path` begins with it. Followers of a class have a longer base path,
since the addresses of a class begin with its link. The base path is kept decoded, without a slash at its end, and only
this module encodes it. All addresses that the server sends are relative to it (`session/1f`, not `/session/1f`), except
redirections and printed links. A page carries it once, as its `<base>`.
"""

import re
from collections.abc import Mapping
from typing import Any, Protocol
from urllib.parse import quote, unquote

KEPT = "/@:~!$&'()*+="
"""Unescaped characters of a path besides letters, digits and `-._`; a semicolon would end the path of a cookie."""
LINKS = "/f"
"""First part of the addresses of links that give rights of their own."""
GUEST = "pftrack.guest"
"""Key in a request's scope of the guest who came by such a link."""
UNFIT = re.compile(r"[\x00-\x1f\x7f\\]")


class Guest(Protocol):
    """Somebody who came by a link, with its rights alone."""

    @property
    def about(self) -> str:
        """Attributes that describe the guest to a page's scripts."""

    def may_steer(self, session: str) -> bool:
        """Return whether the guest may steer a session, not only watch it."""


def guest_of(scope: Mapping[str, Any]) -> Guest | None:
    """Return the guest who came by a link; None for a client with the rights of the whole server."""
    found: Guest | None = scope.get(GUEST)
    return found


def read_base_path(text: str) -> str:
    """Return a typed base path, decoded and without a slash at its end; empty at the root.

    Args:
        text: Such as `/any/prefix` or `/@/space%20word/`.

    Raises:
        ValueError: The text is not a base path.
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
    """Return a path, percent-encoded for an address."""
    return quote(path, safe=KEPT)


def route_path(scope: Mapping[str, Any]) -> str:
    """Return the path of a request without the base path, as the app's routes expect it."""
    path: str = scope["path"]
    return path.removeprefix(scope.get("root_path", ""))


def address_of(scope: Mapping[str, Any], path: str = "") -> str:
    """Return an address of the server as its client sees it, starting with the slash after the host.

    Args:
        scope: The request's ASGI scope.
        path: Relative to the base, encoded.
    """
    return f"{encode_path(scope.get('root_path', ''))}/{path}"
