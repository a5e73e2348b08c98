"""Sweeps: thousands of runs that nobody watches one by one, computed by a child of the server.

The server says what is to be computed, and looks at the files that appear. It counts nothing itself: rates, intervals
and tests come from `pftrack.sweep`.

- `views`: what a client receives
- `planning`: from a body to a plan, each refusal with the field that it is about; how long a plan will take
- `examples`: a filled-in body for every experiment
- `manager`: all sweeps of a server; `sweep`: one of them
- `computing`, `functions`: the process that computes a sweep, as the server sees it and from within
- `tally`: what is on the disk so far, counted; `results`: questions about it
- `reasons`: why a sweep stopped, in words
- `listener`: the stream to the pages; `opening`: from a row to a live session
"""

__all__: list[str] = []
