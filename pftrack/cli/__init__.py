"""The command line: one module a command, or a group of commands, over the library.

`app` has the application and its commands, and `output` says how results and errors are written. Names that differ from
their commands: `run` has `run`, `replay` and `show-recipe`; `listing` has `list` and `show`; `checks` has `reproduce`,
`bench` and `doctor`; `exports` has `export`, `exercises` has `exercise`, `filters` has `new filter`, and `results` has
`open`.
"""

from pftrack.cli.app import main

__all__ = ["main"]
