"""The body of a process of the pool: it carries out the tasks that come over a socket.

Signals are the driver's business: a terminal sends Ctrl-C to the whole group, and the workers let the driver decide.
"""

import signal
import sys
from contextlib import suppress
from multiprocessing.connection import Connection

from pftrack.process import follow_parent, leave_interrupts_to_parent
from pftrack.sweep.work import one_thread

__all__ = ["serve"]


def serve(descriptor: int, driver: int) -> None:
    """Carry out tasks until the socket is closed or the driver is gone, in the middle of a task too.

    Args:
        descriptor: The socket.
        driver: Process number of the driver.
    """
    leave_interrupts_to_parent()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    one_thread()
    follow_parent(driver)
    with Connection(descriptor) as connection, suppress(EOFError, BrokenPipeError, ConnectionResetError):
        while True:
            function, arguments = connection.recv()
            try:
                answer: tuple[str, object] = "", function(*arguments)
            except Exception as error:  # noqa: BLE001 - the driver reports it
                answer = f"{type(error).__name__}: {error}", None
            connection.send(answer)


if __name__ == "__main__":
    serve(int(sys.argv[1]), int(sys.argv[2]))
