"""The fork server of everything that the server does in processes of its own.

Sessions, tasks, lessons and sweeps are forks of one process that has imported and loaded all that is compiled, so that
each begins in milliseconds and shares its memory.
"""

from pftrack.process import ForkServer

FORK_SERVER = ForkServer("pftrack_server.web.preload", secrets=("PFTRACK_TOKEN",))
