"""A fork server of children that do what they are told, in a process without threads: pytest has some."""

import json
import os
import signal
import sys
import time
from multiprocessing.connection import Connection
from typing import Any

from pftrack.process import ForkServer
from pftrack.process.fork_server import serve


def obey(connection: "Connection[Any, Any]") -> None:
    """Say who this is, then end as told."""
    connection.send((os.getpid(), os.getppid(), os.getpgid(0), signal.getsignal(signal.SIGTERM) == signal.SIG_IGN))
    match connection.recv():
        case "exit":
            os._exit(3)
        case "fail":
            raise RuntimeError("on purpose")
        case "hang":
            time.sleep(60)


def endings(server: ForkServer) -> dict[str, str]:
    """Have children end in every way, two at a time, and return what the fork server says of them."""
    said = {}
    for number, how in enumerate(("exit", "fail", "return", "hang", "killed")):
        connection, other = server.start(2 * number), server.start(2 * number + 1)
        with connection, other:
            process, parent, group, deaf = connection.recv()
            assert (parent, group, deaf) == (other.recv()[1], os.getpgid(0), True)
            if how == "killed":
                os.kill(process, signal.SIGKILL)
            else:
                connection.send(how)
            if how != "hang":
                assert connection.poll(30)  # its end is closed
            said[how] = server.end(2 * number)
        server.end(2 * number + 1)
    return said


if __name__ == "__main__":
    if len(sys.argv) > 1:
        serve(Connection(int(sys.argv[1])), obey)
    else:
        forked = ForkServer.forked(obey)
        json.dump(endings(forked), sys.stdout)
        forked.close()
