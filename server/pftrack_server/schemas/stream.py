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
    """What a page says on any stream, to measure the delay."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["ping"]
    sent: Annotated[float, Field(allow_inf_nan=False)]


class Painted(BaseModel):
    """How many drawings of a session's stream a page has painted or left out since it came."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    type: Literal["painted"]
    count: Annotated[int, Field(ge=0)]


PAGE_WORDS: TypeAdapter[Ping | Painted] = TypeAdapter(Annotated[Ping | Painted, Field(discriminator="type")])


def encode(message: Message) -> str:
    """Return a message as JSON text; a number that is not finite becomes null."""
    return message.model_dump_json()


def page_words(text: str) -> Ping | Painted:
    """Read what a page says.

    Raises:
        ValueError: A page says nothing like that.
    """
    return PAGE_WORDS.validate_json(text)
