"""No smoothing of the stream: a frame is handed on in the browser as soon as it is there.

viser's client spaces out messages by the times at which the server says it sent them. One that was late once, because
the machine was busy, makes all that follow late, by up to a tenth of a second, for seconds. It hands on at once what
was sent long after the message before it; so the server's clock, which serves nothing else, is made to run fast.
"""

import time

from viser.infra import _infra

FAST = 1e6
"""Messages that leave a microsecond apart seem a second apart, and viser does not smooth from 100 ms on."""


class _FastClock:
    """What viser's sender takes from the module `time`."""

    @staticmethod
    def perf_counter() -> float:
        """Return a time that runs fast, s."""
        return FAST * time.perf_counter()


def install() -> None:
    """Make the clock of viser's sender run fast; there is no public way to have no smoothing."""
    _infra.time = _FastClock  # type: ignore[attr-defined,assignment]  # a module of viser's own
