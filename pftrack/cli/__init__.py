"""The command line: one module a command, or a group of commands, over the library.

- `app`: the application and its commands; `output`: how results and errors are written;
- `run`: `run` and `replay`; `sweep`; `lessons`; `listing`: `list` and `show`;
- `checks`: `reproduce`, `bench` and `doctor`.
"""

from pftrack.cli.app import main

__all__ = ["main"]
