"""Compiling all that is compiled, once on each machine, before somebody waits for it.

Numba compiles a function when it is first called and keeps it on disk. Calling everything once takes most of a minute,
so processes of low priority do it, case by case on all processors, and their owner looks at their progress; what has
been compiled stays when they are ended.

- `coverage`: which runs call everything that an experiment compiles;
- `schedule`: which process makes which of them; `warming`: the processes together, seen from outside;
- `watch`: what a process does that compiles, and how it tells what it compiles; `preload`: what it imports first;
- `progress`: how far it is, in numbers and in words;
- `memory`: which experiments are known to be ready, without calling anything.
"""

from pftrack.doctor.warming.memory import cache_folder, ready, remember, source_hash
from pftrack.doctor.warming.progress import Progress
from pftrack.doctor.warming.warming import Warming

__all__ = ["Progress", "Warming", "cache_folder", "ready", "remember", "source_hash"]
