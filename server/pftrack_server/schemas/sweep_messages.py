"""Messages: the one typed, versioned vocabulary of a sweep's stream.

`hello` carries the complete state; after it come the progress and the cells of the map that have changed.
A page that is slow gets fewer and larger messages, never old ones.
"""

from typing import Literal

from pftrack_server.schemas.stream import Message
from pftrack_server.schemas.sweep_views import CellsPublic, MapPublic, State, SweepPublic


class Hello(Message):
    """The complete state; the first message of every connection."""

    type: Literal["hello"] = "hello"
    sweep: SweepPublic
    cells: CellsPublic


class Progress(Message):
    """Progress and state of the sweep. Rates are in runs a second, times in seconds."""

    type: Literal["progress"] = "progress"
    state: State
    message: str | None
    done: int
    successes: int | None
    rate: float | None
    seconds: float
    seconds_left: float | None
    outcome: str


class Cells(Message):
    """The cells that have changed, by their number: row after row of the y axis."""

    type: Literal["cells"] = "cells"
    done: int
    at: list[int]
    maps: list[MapPublic]
