"""Filters in files: a user's own filter, a Python file of some functions, as a tracker of an experiment.

- `code`: the functions of a file, trust in texts, and calls, with errors located by line; and the parameters of a file,
  from a dataclass with defaults;
- `extension`: the tracker of a file, with defaults for missing functions; an experiment with such trackers, the
  experiment of a recipe, and its outline, which executes nothing.

A recipe holds the texts of the files (`Recipe.filters`), so a run with such a filter is the same everywhere. Each text
that was in force is a version. The version that computes a frame is a parameter like any other: it can change in the
middle of a run, and a change in the past makes a branch.
"""

from pftrack.experiments.own.code import (
    FilterFileError,
    digest_of,
    is_trusted,
    slider,
    trust,
    trust_filters,
    with_digests,
    with_texts,
)
from pftrack.experiments.own.extension import (
    experiment_of,
    extend,
    name_of,
    new_defaults,
    outline,
    parameters_of,
    version_parameter,
    widen,
)

__all__ = [
    "FilterFileError",
    "digest_of",
    "experiment_of",
    "extend",
    "is_trusted",
    "name_of",
    "new_defaults",
    "outline",
    "parameters_of",
    "slider",
    "trust",
    "trust_filters",
    "version_parameter",
    "widen",
    "with_digests",
    "with_texts",
]
