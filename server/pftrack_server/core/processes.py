"""The fork server for all child processes of the server.

Sessions, tasks, lessons and sweeps are forks of one process that has imported all modules and loaded all compiled code.
So each starts in milliseconds and shares that memory.
"""

from pftrack.process import ForkServer

FORK_SERVER = ForkServer("pftrack_server.web.preload", secrets=("PFTRACK_TOKEN",))
