"""The base of all streams to the pages: versioned messages, and pings by which a page measures the delay."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

VERSION: Literal[1] = 1


class Message(BaseModel):
    """Base of all messages: each names its version and its type."""

    model_config = ConfigDict(frozen=True)

    version: Literal[1] = VERSION


class Pong(Message):
    """The answer to a ping, with its time."""

    type: Literal["pong"] = "pong"
    sent: float


class Ping(Message):
    """The only thing that a page says on the stream."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["ping"]
    sent: Annotated[float, Field(allow_inf_nan=False)]


PING: TypeAdapter[Ping] = TypeAdapter(Ping)


def encode(message: Message) -> str:
    """Return a message as JSON text; a number that is not finite becomes null."""
    return message.model_dump_json()


def ping(text: str) -> Ping:
    """Read what a page sent.

    Raises:
        ValueError: It is no ping of this version.
    """
    return PING.validate_json(text)
