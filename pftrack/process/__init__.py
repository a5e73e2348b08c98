"""Processes: the one way in which pftrack starts child processes, confines them, and says how they ended.

A child is a fresh interpreter or a fork of a warm one that has no threads (`fork_server`), never a copy of the caller,
whose threads may hold locks. The parent side (`child`) gives a child its command, environment and process group, and
turns its exit status into an `Ending`. The child side (`limits`) gives up what it does not need before it touches
anything that came from elsewhere: memory, processor time, files, the network, and what a fork has brought along.
"""

from pftrack.process.child import ONE_THREAD, Ending, command, describe, end_group, ending, environment, follow_parent
from pftrack.process.fork_server import ForkServer
from pftrack.process.limits import confine, leave_interrupts_to_parent, stand_alone

__all__ = [
    "ONE_THREAD",
    "Ending",
    "ForkServer",
    "command",
    "confine",
    "describe",
    "end_group",
    "ending",
    "environment",
    "follow_parent",
    "leave_interrupts_to_parent",
    "stand_alone",
]
