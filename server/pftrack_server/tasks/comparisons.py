"""Comparing runs in a confined process: they are made by the door that sessions come in by, under the same limits."""

from collections.abc import Generator, Sequence
from pathlib import Path
from typing import Any

from pftrack.core.files import write_whole
from pftrack.core.model.setup import find_export
from pftrack.experiments.own.code import trust
from pftrack.output.exports.comparisons import COMPARISON_FORMATS
from pftrack.runs.comparison import Comparison
from pftrack_server.worker.protocol import WorkerConfig
from pftrack_server.worker.run_tree import RunTree


def outline_comparison(configs: Sequence[WorkerConfig]) -> dict[str, Any]:
    """Return what is known of a comparison before anything is computed: which frames, what differs, what to call each.

    Raises:
        ComparisonError: The runs cannot be compared.
    """
    compared = _start(configs)
    return {
        "unit": compared.unit,
        "frames": compared.alignment.frames,
        "firsts": list(compared.alignment.firsts),
        "names": list(compared.names),
        "colours": list(compared.colours),
        "settings": [setting.as_dict() for setting in compared.settings],
    }


def compare_runs(configs: Sequence[WorkerConfig]) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Compute all frames that runs have in common, and return what they come to; a step is a frame of a run."""
    compared = _start(configs)
    yield from compared.computing()
    return compared.as_dict()


def write_comparison(
    configs: Sequence[WorkerConfig], export: str, path: str
) -> Generator[tuple[int, int], None, dict[str, Any]]:
    """Compute all frames that runs have in common, and write what they come to as a file.

    Args:
        configs: Of the runs.
        export: Name of the export.
        path: Where to.
    """
    compared = _start(configs)
    yield from compared.computing()
    write_whole(Path(path), find_export(COMPARISON_FORMATS, export).make(compared))
    return {}


def _start(configs: Sequence[WorkerConfig]) -> Comparison:
    for config in configs:
        trust(*config.filters)
    return Comparison.of(*(RunTree(config).run for config in configs))
