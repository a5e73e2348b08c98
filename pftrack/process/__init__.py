"""Processes: the one way in which pftrack starts child processes, confines them, and reports how they ended.

A child is a fork of a warm process that has no threads (`fork_server`), never a copy of its parent, whose threads may
hold locks. The parent talks with it through a pipe (`pipe`, `child`). Most children answer calls, with JSON if they
read data from elsewhere (`calls`): alone for one task, or kept in a pool (`pool`). Before that they give up what they
do not need (`limits`): memory, processor time, files, the network, and whatever a fork has inherited.
"""

from pftrack.process.calls import Fault, Outcome, Refusal, Reply, report
from pftrack.process.child import AsyncEnd, BlockingEnd, Child, Ending, describe, ending, run
from pftrack.process.fork_server import ForkServer
from pftrack.process.limits import (
    MEBIBYTE,
    UNLIMITED,
    Budget,
    confine,
    end_with_parent,
    give_way,
    leave_interrupts_to_parent,
    take_secret,
)
from pftrack.process.pool import BackgroundLoop, BlockingPool, CallError, Pool, Worker, WorkerLostError, run_task

__all__ = [
    "MEBIBYTE",
    "UNLIMITED",
    "AsyncEnd",
    "BackgroundLoop",
    "BlockingEnd",
    "BlockingPool",
    "Budget",
    "CallError",
    "Child",
    "Ending",
    "Fault",
    "ForkServer",
    "Outcome",
    "Pool",
    "Refusal",
    "Reply",
    "Worker",
    "WorkerLostError",
    "confine",
    "describe",
    "end_with_parent",
    "ending",
    "give_way",
    "leave_interrupts_to_parent",
    "report",
    "run",
    "run_task",
    "take_secret",
]
