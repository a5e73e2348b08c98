"""What a run can be exported as: the files that its experiment offers of a frame, and the run itself as a notebook."""

from collections.abc import Callable
from dataclasses import dataclass

from pftrack.experiment import Experiment
from pftrack.export import Export
from pftrack.runs.notebook import run_notebook
from pftrack.runs.run import Run

__all__ = ["NOTEBOOK", "RunExport", "exports_of"]


@dataclass(frozen=True, slots=True)
class RunExport:
    """A file that can be made of a run.

    Attributes:
        name: Name in commands and addresses.
        title: What it is, a few words.
        suffix: Of the file's name, without the dot.
        media_type: Of the file.
        make: What makes it, of the frame at which the run stands and those before it, or of the whole run.
    """

    name: str
    title: str
    suffix: str
    media_type: str
    make: Callable[[Run], bytes]


NOTEBOOK = RunExport("notebook", "Notebook of the run (Jupyter)", "ipynb", "application/x-ipynb+json", run_notebook)


def exports_of(experiment: Experiment) -> tuple[RunExport, ...]:
    """Return all that a run of an experiment can be exported as."""
    return (*map(_of_frame, experiment.exports), NOTEBOOK)


def _of_frame(export: Export) -> RunExport:
    def make(run: Run) -> bytes:
        return export.make(run.current.state, run.diagnostics[: run.position + 1])

    return RunExport(export.name, export.title, export.suffix, export.media_type, make)
