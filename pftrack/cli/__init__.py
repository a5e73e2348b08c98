"""The command line: one module a command, or a group of commands, over the library.

`app` has the application; `output` writes results and errors, and has the options that commands share. `experiments`
has `list`, `show` and `new`; `run` has `run`, `replay`, `open` and `show-recipe`; `exports` has `export`; `analysis`
has `compare`, `explain`, `fit` and `failures`; `sweep` has `sweep` and `learn`; `teaching` has `lessons` and
`exercise`; `checks` has `reproduce`, `evaluate`, `bench` and `doctor`. `footage` has the options of a recording.
"""

from pftrack.cli.app import main

__all__ = ["main"]
