"""Properties of every experiment, as checks that an experiment's own tests run.

The command line, the server and sweeps rely on promises that no type can express: a run has the same numbers on every
path to a frame, a batch equals the live run, a drawing uses only declared layers. An experiment that keeps them works
everywhere. Its tests need a few lines for that, in the manner of scikit-learn's `check_estimator`:

    @pytest.mark.parametrize("check", experiment_checks(EXPERIMENT), ids=str)
    def test_it_keeps_what_every_experiment_promises(check):
        check()

- `declarations`: identity, parameters, presets, plots and readings are complete and consistent; its kinds of mark
  describe themselves, and refuse invalid marks;
- `numbers`: reports of a tracker are finite and as declared; its model gives the filter's weights at any state, and a
  linear one is the model that the filter uses; seek, branch, file, process, batch and change of tracker give the same
  numbers;
- `coverage`: bands hold the truth as often as is declared; each failure still fails in its own way, and its cure works;
  other seeds and changes can be computed; a loss probability is a probability, on every path to it;
- `drawings`: they are finite, within reach of the picture, on declared layers and stable from frame to frame; and
  a film of its own scene is tracked from a mark, as an upload is.
"""

from functools import partial

from pftrack.experiments.experiment import Experiment
from pftrack.testing import declarations, drawings, numbers  # noqa: F401 - they add checks
from pftrack.testing.check import OF_EACH, OF_WHOLE, Check, CheckError
from pftrack.testing.coverage import failure_checks, thorough_checks

__all__ = ["Check", "CheckError", "check_experiment", "experiment_checks"]


def experiment_checks(experiment: Experiment, *, thorough: bool = False) -> tuple[Check, ...]:
    """Return all checks of an experiment, each named by its property.

    Args:
        experiment: The experiment in the registry, because a saved run finds its experiment by its id.
        thorough: Whether bands are measured over forty seeds of the default scene and of the presets that the
            calibration names as well, which takes minutes.
    """
    return (
        *(Check(name, partial(function, experiment)) for name, function in OF_WHOLE.items()),
        *(
            Check(f"{name} ({tracker})", partial(function, experiment, tracker))
            for tracker in experiment.trackers
            for name, function in OF_EACH.items()
        ),
        *failure_checks(experiment),
        *(thorough_checks(experiment) if thorough else ()),
    )


def check_experiment(experiment: Experiment) -> None:
    """Run all checks of an experiment.

    Raises:
        CheckError: A check fails; the sentence gives the actual and the required behaviour.
    """
    for check in experiment_checks(experiment):
        check()
