"""A participant: whoever came by the link of a class, as handlers learn of it."""

from collections.abc import MutableMapping
from typing import TYPE_CHECKING, Any, NamedTuple

from pftrack_server.follow.links import Claim
from pftrack_server.follow.roles import Reach, Standing

if TYPE_CHECKING:
    from pftrack_server.follow.follow import Follow


PARTICIPANT = "pftrack.participant"


class Participant(NamedTuple):
    """Whoever came by a link.

    Attributes:
        follow: The class.
        claim: What the link says.
        seat: The follower's name within it; empty for an owner.
        role: What the participant is.
    """

    follow: "Follow"
    claim: Claim
    seat: str
    role: Standing

    @property
    def reach(self) -> Reach:
        """What may be named in an address at the moment."""
        return self.follow.reach(self.role, self.seat)

    def put_into(self, scope: MutableMapping[str, Any]) -> None:
        """Let the handlers of a request or websocket know."""
        scope[PARTICIPANT] = self


def participant_of(scope: MutableMapping[str, Any]) -> Participant | None:
    """Return who came by a link; None for somebody with the rights of the whole server."""
    found: Participant | None = scope.get(PARTICIPANT)
    return found
