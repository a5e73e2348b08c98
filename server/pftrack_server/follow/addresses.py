"""Addresses: under which names other machines reach this server, so that a link can be opened there."""

import socket
from typing import NamedTuple
from urllib.parse import urlsplit

import psutil

from pftrack_server.core.settings import Settings, is_loopback

NOTICE = (
    "Only this machine reaches the server. Start it with `pftrack serve --host 0.0.0.0`, in a network that you trust, "
    "so that others can follow."
)


class Address(NamedTuple):
    """Where the server is.

    Attributes:
        base: Scheme, host, port and base path, without a slash at its end.
        everybody: Whether other machines can reach it there.
    """

    base: str
    everybody: bool


def addresses(base: str, settings: Settings) -> list[Address]:
    """Return where the server can be reached, the best first.

    Args:
        base: Where the lecturer's own browser reaches it.
        settings: Of the server.
    """
    parts = urlsplit(base)
    if not is_loopback(parts.hostname or ""):
        return [Address(base, everybody=True)]
    port = f":{parts.port}" if parts.port else ""
    names = [name for name in _names(settings) if {"*", name} & set(settings.hosts)]
    return [
        *(Address(f"{parts.scheme}://{_bracket(name)}{port}{parts.path}", everybody=True) for name in names),
        Address(base, everybody=False),
    ]


def _names(settings: Settings) -> list[str]:
    """Return the addresses of this machine at which the server listens for others."""
    if is_loopback(settings.host):
        return []
    if settings.host not in {"0.0.0.0", "::", ""}:  # noqa: S104 - compared, not bound
        return [settings.host]
    states = psutil.net_if_stats()
    return [
        address.address
        for name, found in psutil.net_if_addrs().items()
        if name in states and states[name].isup
        for address in found
        if address.family == socket.AF_INET and not is_loopback(address.address)
    ]


def _bracket(name: str) -> str:
    return f"[{name}]" if ":" in name else name
