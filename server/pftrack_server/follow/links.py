"""Links: who holds one has a role in one follow, and nobody can make one up.

A link is the follow's name and a signature of name and role, in letters that cannot be mistaken for one another
(Crockford's base 32), so that a follower's can be read from a wall and typed: 4 letters name the follow, 8 letters (40
bits) sign it. A lecturer's is never typed and has 24 letters of signature (120 bits). Guessing one at a thousand tries
a second takes 17 years on average for one that lives for hours.
"""

import hashlib
import hmac
import secrets
from base64 import b32encode
from typing import Final, Literal, NamedTuple

from itsdangerous import BadSignature, Signer
from itsdangerous.encoding import base64_decode

PREFIX = "/f"
"""Where the addresses of all links are, behind the server's base path."""

Role = Literal["owner", "follower"]

STANDARD: Final = "ABCDEFGHIJKLMNOPQRSTUVWXYZ234567"
LETTERS: Final = "0123456789abcdefghjkmnpqrstvwxyz"
PRINTED = str.maketrans(STANDARD, LETTERS)
TYPED = str.maketrans({"o": "0", "i": "1", "l": "1", "-": None, " ": None})
NAME, GROUP = 4, 4
SIGNATURE_BYTES: dict[Role, int] = {"follower": 5, "owner": 15}
LONGEST = 64


class Claim(NamedTuple):
    """What a link says, signed by this server."""

    follow: str
    role: Role
    link: str


class Links:
    """The links of one server's life, signed by a key that nobody else ever sees."""

    def __init__(self) -> None:
        self._key = secrets.token_bytes(32)

    def new_name(self) -> str:
        """Return a name for a follow, which is the beginning of its links."""
        return "".join(secrets.choice(LETTERS) for _ in range(NAME))

    def of(self, follow: str, role: Role) -> str:
        """Return the link for a role, as it is printed."""
        signature = base64_decode(self._signer("link", role).get_signature(follow))[: SIGNATURE_BYTES[role]]
        letters = follow + b32encode(signature).decode().translate(PRINTED)
        return "-".join(letters[at : at + GROUP] for at in range(0, len(letters), GROUP))

    def read(self, typed: str) -> Claim | None:
        """Return what a link says, however it was typed; None if this server has not signed it."""
        letters = typed[:LONGEST].lower().translate(TYPED)
        if not letters.isascii():
            return None
        for role in SIGNATURE_BYTES:
            link = self.of(letters[:NAME], role)
            if hmac.compare_digest(link.replace("-", "").encode(), letters.encode()):
                return Claim(letters[:NAME], role, link)
        return None

    def new_seat(self, follow: str) -> str:
        """Return what a browser keeps to be known again as the same follower of one follow."""
        return self._signer("seat", follow).sign(secrets.token_urlsafe(12)).decode()

    def read_seat(self, follow: str, kept: str) -> str | None:
        """Return the name of the follower who keeps this; None if this server has not signed it for this follow."""
        try:
            return self._signer("seat", follow).unsign(kept).decode()
        except (BadSignature, UnicodeError):
            return None

    def _signer(self, *purpose: str) -> Signer:
        return Signer(self._key, salt=":".join(purpose), digest_method=hashlib.sha256, key_derivation="hmac")
