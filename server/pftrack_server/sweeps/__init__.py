"""Sweeps: thousands of unwatched runs, computed by a child process of the server.

The server plans what to compute, and reads the files that appear. It computes no statistics: rates, intervals and tests
come from `pftrack.sweep`.

- `planning`: from a body to a plan, each refusal with its field; an example for every experiment
- `manager`: all sweeps of a server; `sweep`: one of them, and the pages that watch it
- `functions`: functions of the process that computes a sweep, measures one, or writes its files
- `results`: counts of the results on disk so far, queries on them, and from a row to a live session
- `routes`: the addresses, and the stream
"""
