"""The fork server: a process that has imported everything and waits, from which others are forked in milliseconds.

A fresh interpreter needs most of a second of processor time before it computes; a fork of a warm one shares with its
siblings what they all have imported. It starts no threads, since a fork copies the locks that they hold, but not them.
It lives as long as the socket between it and its owner; its children follow it.
"""

import gc
import os
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.reduction import recv_handle, send_handle
from typing import Any, NoReturn, TypeAlias

from pftrack.process.child import command, describe, environment, follow_parent
from pftrack.process.limits import leave_interrupts_to_parent

__all__ = ["ForkServer", "serve"]

Body: TypeAlias = Callable[[Connection], None]

GRACE_S = 5.0
LOOK_S = 0.05
"""How long a child whose socket is closed may take to end by itself."""


class ForkServer:
    """A fork server, as its owner sees it; its children are known by numbers that the owner chooses."""

    def __init__(self, connection: "Connection[Any, Any]", wait: Callable[[], object]) -> None:
        """Take over a fork server that runs; `wait` waits for its end."""
        self._connection, self._wait = connection, wait

    @classmethod
    def fresh(cls, module: str) -> "ForkServer":
        """Start one in a fresh interpreter.

        Args:
            module: Is run there; it calls `serve` with the socket of which the descriptor is its argument.
        """
        ours, theirs = Pipe()
        # In the owner's own group: whoever ends the group of a driver ends all that belongs to it.
        process = subprocess.Popen(  # noqa: S603 - this very Python and a module of ours
            command(module, str(theirs.fileno())),
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            env=environment(),
        )
        theirs.close()

        def wait() -> None:
            with suppress(subprocess.TimeoutExpired):
                process.wait(GRACE_S)
            process.kill()
            process.wait()

        return cls(ours, wait)

    @classmethod
    def forked(cls, body: Body) -> "ForkServer":
        """Fork one off this process, which must not have started a thread yet."""
        ours, theirs = Pipe()
        sys.stdout.flush()
        process = os.fork()
        if process == 0:
            ours.close()
            _end_after(serve, theirs, body)
        theirs.close()
        return cls(ours, lambda: os.waitpid(process, 0))

    def start(self, number: int) -> "Connection[Any, Any]":
        """Have a child forked, and return the socket to it; one that cannot be forked closes it.

        Raises:
            OSError: The fork server was lost.
        """
        ours, theirs = Pipe()
        with theirs:
            self._connection.send((number, True))
            send_handle(self._connection, theirs.fileno(), 0)
        return ours

    def end(self, number: int) -> str:
        """End a child; return in words how it ended if it had already."""
        try:
            self._connection.send((number, False))
            return str(self._connection.recv())
        except (EOFError, OSError):
            return "lost with the process that had started it"

    def close(self) -> None:
        """End it, and with it all of its children."""
        self._connection.close()
        self._wait()


def serve(connection: "Connection[Any, Any]", body: Body) -> None:
    """Fork children until the owner lets go of the socket.

    Signals are the owner's business: a terminal sends Ctrl-C to the whole group, and the owner decides.

    Args:
        connection: To the owner.
        body: What a child does with the socket that it is given.
    """
    leave_interrupts_to_parent()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    # A child's garbage collector would touch every object that is here, and so copy pages that all of them share.
    gc.freeze()
    children: dict[int, int] = {}
    failures: dict[int, str] = {}
    with suppress(EOFError, ConnectionError):
        while True:
            number, wanted = connection.recv()
            if wanted:
                descriptor = recv_handle(connection)
                try:
                    children[number] = _forked(connection, body, descriptor)
                except OSError as error:
                    failures[number] = f"not started: {error}"
                finally:
                    os.close(descriptor)
            elif number in children:
                connection.send(_ended(children.pop(number)))
            else:
                connection.send(failures.pop(number))
    for process in children.values():
        os.kill(process, signal.SIGKILL)


def _forked(connection: "Connection[Any, Any]", body: Body, descriptor: int) -> int:
    server = os.getpid()
    process = os.fork()
    if process == 0:
        connection.close()
        follow_parent(server)
        _end_after(body, Connection(descriptor))
    return process


def _end_after(function: Callable[..., None], *arguments: object) -> NoReturn:
    """Call a function in a process that was forked, and end the process as if it had never been anything else."""
    status = 1
    try:
        function(*arguments)
        status = 0
    except BaseException:  # noqa: BLE001 - nothing may come back to where this process was forked
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(status)


def _ended(process: int) -> str:
    """End a child, which has a moment to do that by itself, and return in words how it had ended if it had."""
    until = time.monotonic() + LOOK_S
    ended, status = os.waitpid(process, os.WNOHANG)
    while not ended and time.monotonic() < until:
        time.sleep(LOOK_S / 20)
        ended, status = os.waitpid(process, os.WNOHANG)
    if ended:
        return describe(os.waitstatus_to_exitcode(status))
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return "ended"
