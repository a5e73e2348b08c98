"""A fork server in a fresh interpreter; its arguments are the socket to its owner, and the module to import first."""

import sys

from pftrack.process.fork_server import main

if __name__ == "__main__":
    main(int(sys.argv[1]), sys.argv[2])
