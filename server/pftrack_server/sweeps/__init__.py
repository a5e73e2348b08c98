"""Sweeps: thousands of runs that nobody watches one by one, computed by a child of the server.

The server says what is to be computed, and looks at the files that appear. It counts nothing itself: rates, intervals
and tests come from `pftrack.sweep`.

- `planning`: from a body to a plan, each refusal with the field that it is about; an example for every experiment
- `manager`: all sweeps of a server; `sweep`: one of them, and the pages that watch it
- `functions`: what the process does that computes a sweep, measures one, or writes its files
- `results`: what is on the disk so far, counted, questions about it, and from a row to a live session
- `routes`: the addresses, and the stream
"""
