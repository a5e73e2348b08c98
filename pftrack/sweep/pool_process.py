"""The fork server of a pool in a fresh interpreter: the socket to its owner is the descriptor that is its argument."""

import sys
from multiprocessing.connection import Connection

from pftrack.numerics.elementary import exponential
from pftrack.process.fork_server import serve
from pftrack.sweep.pool import work

__all__: list[str] = []

if __name__ == "__main__":
    exponential(0.0)  # makes Numba ready, which would cost every process of the pool 0.3 s
    serve(Connection(int(sys.argv[1])), work)
