"""Loading what an experiment has compiled, in the fork server: its workers share it and begin without that."""

from itertools import islice

from pftrack.doctor.compiling import cases, run_case
from pftrack.doctor.memory import cache_folder
from pftrack.experiments import EXPERIMENTS
from pftrack.vision.rendering import png, render


def load_compiled(name: str) -> None:
    """Step and draw an experiment as it is by default for some frames, which takes 0.1 to 0.5 s.

    What its other trackers and settings call is loaded by the workers that use them; where compiled code cannot be kept
    on the disk, all of it is compiled here, or each worker would do so. An experiment of another package is left alone:
    what it does wrong shall happen in its own workers.
    """
    if name in EXPERIMENTS.own:
        experiment = EXPERIMENTS[name]
        for tracker, values in islice(cases(experiment), 1 if cache_folder() else None):
            drawing = run_case(experiment, tracker, values)
        png(render(drawing))
