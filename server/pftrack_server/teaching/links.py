"""Links: unforgeable addresses that give a role in one follow; and the addresses where other machines open them.

A link is the follow's name and a signature of name and role, in unambiguous letters (Crockford's base 32), so that a
follower's link can be read from a wall and typed: 4 letters name the follow, 8 letters (40 bits) sign it. A lecturer's
link is never typed and has 24 letters of signature (120 bits). Guessing a follower's link at a thousand tries a second
would take 17 years on average; it is valid for hours.
"""

import hashlib
import hmac
import secrets
import socket
from base64 import b32encode
from typing import Final, Literal, NamedTuple
from urllib.parse import urlsplit

import psutil
from itsdangerous import BadSignature, Signer
from itsdangerous.encoding import base64_decode

from pftrack_server.core.settings import Settings, is_loopback

Role = Literal["owner", "follower"]

STANDARD: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"
LETTERS: Final = "0123456789abcdefghjkmnpqrstvwxyz"
PRINTED = str.maketrans(STANDARD, LETTERS)
TYPED = str.maketrans({"o": "0", "i": "1", "l": "1", "-": None, " ": None})
NAME, GROUP = 4, 4
SIGNATURE_BYTES: dict[Role, int] = {"follower": 5, "owner": 15}
LONGEST = 64

NOTICE = (
    "Only this machine reaches the server. Start it with `pftrack serve --host 0.0.0.0`, in a network that you trust, "
    "so that others can follow."
)


class Claim(NamedTuple):
    """The content of a link that this server has signed."""

    follow: str
    role: Role
    link: str


class Links:
    """The links of one run of the server, signed with a key that never leaves it."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)

    def new_name(self) -> str:
        """Return a new name for a follow; its links begin with it."""
        return "".join(secrets.choice(LETTERS) for _ in range(NAME))

    def of(self, follow: str, role: Role) -> str:
        """Return the printable link for a role."""
        signature = base64_decode(self._signer("link", role).get_signature(follow))[: SIGNATURE_BYTES[role]]
        letters = follow + b32encode(signature).decode().translate(PRINTED)
        return "-".join(letters[at : at + GROUP] for at in range(0, len(letters), GROUP))

    def read(self, typed: str) -> Claim | None:
        """Return the content of a typed link, in any spelling; None if this server has not signed it."""
        letters = typed[:LONGEST].lower().translate(TYPED)
        if not letters.isascii():
            return None
        for role in SIGNATURE_BYTES:
            link = self.of(letters[:NAME], role)
            if hmac.compare_digest(link.replace("-", "").encode(), letters.encode()):
                return Claim(letters[:NAME], role, link)
        return None

    def new_seat(self, follow: str) -> str:
        """Return a new cookie value by which a browser is recognised as the same follower of one follow."""
        return self._signer("seat", follow).sign(secrets.token_urlsafe(12)).decode()

    def read_seat(self, follow: str, kept: str) -> str | None:
        """Return the seat in a cookie value; None if this server has not signed it for this follow."""
        try:
            return self._signer("seat", follow).unsign(kept).decode()
        except (BadSignature, UnicodeError):
            return None

    def _signer(self, *purpose: str) -> Signer:
        return Signer(self._key, salt=":".join(purpose), digest_method=hashlib.sha256, key_derivation="hmac")


class Address(NamedTuple):
    """An address of the server.

    Attributes:
        base: Scheme, host, port and base path, without a slash at its end.
        everybody: Whether other machines can reach the server there.
    """

    base: str
    everybody: bool


def addresses(base: str, settings: Settings) -> list[Address]:
    """Return the addresses of the server, the best first.

    Args:
        base: Address at which the lecturer's own browser reaches the server.
        settings: Settings of the server.
    """
    parts = urlsplit(base)
    if not is_loopback(parts.hostname or ""):
        return [Address(base, everybody=True)]
    port = f":{parts.port}" if parts.port else ""
    known = (name for name in _names(settings) if {"*", name} & set(settings.hosts))
    names = [f"[{name}]" if ":" in name else name for name in known]
    return [
        *(Address(f"{parts.scheme}://{name}{port}{parts.path}", everybody=True) for name in names),
        Address(base, everybody=False),
    ]


def _names(settings: Settings) -> list[str]:
    """Return the names and addresses of this machine at which others can reach the server."""
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
