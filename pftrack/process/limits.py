"""Limits that a child process sets itself before it touches data from elsewhere, so it harms only itself.

They are those of the operating system, and none can be raised again. Linux has all of them; other Unixes lack those on
memory and on the network. They stop a runaway program. An attacker who takes over a confined process is still the same
user, with that user's files; and a fork has the memory of its parent. So a program takes a secret out of its
environment before it makes children (`take_secret`).
"""

import ctypes
import math
import os
import resource
import signal
import sys
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

MEBIBYTE = 1024**2

CPU_GRACE_S = 5
"""Time between the signal that gives the reason and the one that cannot be caught."""

NEW_NETWORK, NEW_USER = 0x40000000, 0x10000000
"""Flags of unshare(2)."""

SACRIFICE = 500
"""For oom_score_adj: as if the process used half of all memory in addition."""

END_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of prctl(2)."""

ADOPT_ORPHANS = 36
"""PR_SET_CHILD_SUBREAPER."""

LOOK_S = 0.5

PATIENCE_S, AUTOGROUP_WAIT_S = 1.0, 0.05
"""The kernel allows one change of an autogroup in a tenth of a second, on the whole system."""

PIPE = "_PIPE"
"""Suffix of the variable that gives the restarted program the descriptor to read from."""


@dataclass(frozen=True, slots=True)
class Budget:
    """Limits of a child that answers calls.

    Attributes:
        memory_bytes: Address space on top of what is forked with it; None for any.
        cpu_seconds: Processor time; None for any.
        silence_s: Longest silence while it computes; None for ever.
        file_bytes: Length of any file that it writes; None for any.
        open_files: Largest number of descriptors; None for the system's limit.
        answer_bytes: Length of an answer.
        niceness: Its lower priority on the processor.
    """

    memory_bytes: int | None = 1024 * MEBIBYTE
    cpu_seconds: float | None = 30.0
    silence_s: float | None = 30.0
    file_bytes: int | None = None
    open_files: int | None = 64
    answer_bytes: int = 64 * MEBIBYTE
    niceness: int = 0


UNLIMITED = Budget(memory_bytes=None, cpu_seconds=None, silence_s=None, open_files=None)
"""For computations that their owner can end."""


def confine(
    *,
    memory_bytes: int | None = None,
    cpu_seconds: float | None = None,
    file_bytes: int | None = None,
    open_files: int | None = None,
) -> None:
    """Limit this process for good; it leaves no core dump and, where the system allows that, has no network.

    When all memory of the machine or the container is used up, Linux ends this process before its parent.

    Args:
        memory_bytes: Address space in addition to the present one, which is mostly shared with its siblings.
        cpu_seconds: CPU time from now on; then SIGXCPU ends it.
        file_bytes: Length of any file that it writes.
        open_files: Largest number of descriptors.
    """
    _leave_network()
    _be_first_to_go()
    _lower(resource.RLIMIT_CORE, 0)
    if cpu_seconds is not None:
        used = resource.getrusage(resource.RUSAGE_SELF)
        _lower(resource.RLIMIT_CPU, math.ceil(used.ru_utime + used.ru_stime + cpu_seconds), CPU_GRACE_S)
    if file_bytes is not None:
        _lower(resource.RLIMIT_FSIZE, file_bytes)
    if open_files is not None:
        _lower(resource.RLIMIT_NOFILE, open_files)
    if memory_bytes is not None and sys.platform == "linux":
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        _lower(resource.RLIMIT_AS, pages * resource.getpagesize() + memory_bytes)


def leave_interrupts_to_parent() -> None:
    """Ignore Ctrl-C, which a terminal sends to the whole group: ending this process is its parent's business."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def stand_alone(keep: int) -> None:
    """Let go of what a fork has brought along: descriptors, standard streams, terminal and process group.

    The process then leads its own group, so everything it starts can be ended with it, and it ends with its parent.
    Call it after `confine`, since a change of the user namespace may undo that.

    Args:
        keep: The one descriptor that it needs.
    """
    os.setsid()
    nowhere = os.open(os.devnull, os.O_RDWR)
    for standard in range(3):
        os.dup2(nowhere, standard)
    close_descriptors(keep)
    end_with_parent()


def give_way(niceness: int, patience_s: float = PATIENCE_S) -> None:
    """Come after others on the processor, with all that is in the group that this process leads.

    A Linux kernel may first divide processor time among sessions of processes, as `stand_alone` begins one, and heed
    the niceness only among the processes of one (autogroup in sched(7)). So the session's niceness is set as well, to
    half of it: other work has many sessions, not one, and awaited work must finish on a machine that is never idle.

    Args:
        niceness: Increase of the present value.
        patience_s: Longest time to wait for the kernel to accept that of the session; then it stays unchanged.
    """
    total = os.nice(niceness)
    if os.getsid(0) != os.getpid():
        return  # others are in this session
    for remaining in range(round(patience_s / AUTOGROUP_WAIT_S), -1, -1):
        try:
            Path("/proc/self/autogroup").write_text(str(total // 2), encoding="ascii")
        except BlockingIOError:  # another process has just made one
            if remaining:
                time.sleep(AUTOGROUP_WAIT_S)
        except OSError:  # the kernel does no such thing, and niceness does all
            return
        else:
            return


def close_descriptors(keep: int) -> None:
    """Close all descriptors but one and the standard streams."""
    listing = Path("/proc/self/fd" if sys.platform == "linux" else "/dev/fd")
    for descriptor in [int(each.name) for each in listing.iterdir()]:
        if descriptor > 2 and descriptor != keep:
            with suppress(OSError):  # the listing had its own descriptor
                os.close(descriptor)


def end_with_parent() -> None:
    """End this process soon after the one that it was forked from has ended, whatever it is doing."""
    parent = os.getppid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(END_WITH_PARENT, signal.SIGKILL, 0, 0, 0)
        if os.getppid() != parent:
            os._exit(1)
    else:

        def follow() -> None:
            while os.getppid() == parent:
                time.sleep(LOOK_S)
            os._exit(1)

        threading.Thread(target=follow, name="follow-parent", daemon=True).start()


def adopt_orphans() -> None:
    """Become the parent of what children of this process leave behind, however far off; other systems than Linux can't.

    A process may leave its group, but not this line of descent, so it can be found and ended.
    """
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(ADOPT_ORPHANS, 1, 0, 0, 0)


def take_secret(name: str) -> str | None:
    """Return a variable of the environment, from which it is gone then; None if there is none.

    Processes of the same user can read with which environment a program has begun, and a fork has it as well. So where
    the variable is set, the program begins anew without it, and reads it from a pipe. Call this before anything else.
    """
    secret = os.environ.pop(name, None)
    if secret is not None:
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        with suppress(BlockingIOError):  # longer than a pipe takes at once, and than any secret is
            os.write(writing, secret.encode())
        os.close(writing)
        os.set_inheritable(reading, True)
        os.environ[name + PIPE] = str(reading)
        os.execv(sys.executable, [sys.executable, *sys.orig_argv[1:]])  # noqa: S606 - this very program
    pipe = os.environ.pop(name + PIPE, None)
    if pipe is None:
        return None
    with os.fdopen(int(pipe), encoding="utf-8") as reading_end:
        return reading_end.read()


def _lower(what: int, soft: int, grace: int = 0) -> None:
    """Set a limit and, `grace` above it, the one that cannot be raised; neither above what holds already."""
    _, most = resource.getrlimit(what)
    hard = soft + grace if most == resource.RLIM_INFINITY else min(soft + grace, most)
    # If the shell allows less, the signal that gives the reason still comes before the one that cannot be caught.
    resource.setrlimit(what, (max(min(soft, hard - grace), min(1, hard)), hard))


def _be_first_to_go() -> None:
    place = Path("/proc/self/oom_score_adj")
    with suppress(OSError):  # another system than Linux
        place.write_text(str(max(SACRIFICE, int(place.read_text(encoding="ascii")))), encoding="ascii")


def _leave_network() -> None:
    """Move to a network namespace with no interfaces; sockets that are open already keep working.

    A process without privileges needs a user namespace for that, in which it keeps its user and group. Some containers
    allow neither; then the process stays where it is.
    """
    if sys.platform != "linux":
        return
    unshare = ctypes.CDLL(None, use_errno=True).unshare
    user, group = os.geteuid(), os.getegid()
    if unshare(NEW_NETWORK) == 0 or unshare(NEW_USER | NEW_NETWORK) != 0:
        return
    for name, text in (("setgroups", "deny"), ("uid_map", f"{user} {user} 1"), ("gid_map", f"{group} {group} 1")):
        try:
            Path("/proc/self", name).write_text(text, encoding="ascii")
        except OSError:  # the files that it may read stay the same without a name for its user
            return
