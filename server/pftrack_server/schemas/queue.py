"""The place of a request in the queue."""

from pydantic import BaseModel


class QueuePublic(BaseModel):
    """Where a request waits.

    Attributes:
        before: How many come before it.
    """

    before: int
