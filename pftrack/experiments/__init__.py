"""Experiments: source, tracker, parameters, drawing and measure wired together under a name.

Each experiment is a folder beside this file and a line of the list below; other packages add theirs by entry point.
Everything else (command line, server, sweeps) finds an experiment through `find` or `EXPERIMENTS`, and none is imported
before. `shared` holds what several experiments use, `own` the filters in a person's own file.

- `ball`: switching particle filters on a ball behind an occluder (Bando 2007, ch. 3);
- `fish`: a fish that bends, by a filter that is guided by learned changes (Mitsugami et al. 2009);
- `hand`: the pose of a hand by its silhouette, by several hypotheses (Shimada 1997);
- `head`: the pose of a head by its features, simulated or on a recording (Bando 2007, ch. 4);
- `histogram`: a window followed by its colours, past a look-alike and behind a column (Kagami 2012);
- `linkage`: a chain of three links, whose lengths and depth one camera is to tell (Shimada 1997);
- `prism`: a solid's pose by adaptive sampling of its corners (Bando 2007, ch. 4);
- `recorded`: what loops and trackers of others have computed, looked at like any run;
- `sine`: the Kalman filter beside the particle filter on a signal in noise (Bando 2007, ch. 2);
- `structure`: the shape of a body from tracks of its points (Bando 2007, ch. 4 section 5);
- `trajectories`: points that are followed through outliers, each by itself (Ichimura and Ikoma).
"""

from pftrack.core.model.diagnostics import Step
from pftrack.core.model.plot import Plot, Reading
from pftrack.core.model.preset import Preset
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Kind
from pftrack.experiments.experiment import Experiment
from pftrack.experiments.registry import NAME, Plugin, Registry

__all__ = [
    "EXPERIMENTS",
    "NAME",
    "Experiment",
    "Plot",
    "Plugin",
    "Preset",
    "Reading",
    "Setup",
    "Step",
    "find",
    "find_for",
]

EXPERIMENTS = Registry(
    {
        name: f"pftrack.experiments.{name}.experiment:EXPERIMENT"
        for name in (
            "ball",
            "histogram",
            "fish",
            "trajectories",
            "head",
            "hand",
            "linkage",
            "prism",
            "structure",
            "sine",
            "recorded",
        )
    }
)
"""All experiments by name, in the order in which they are shown: places, poses, shapes, a signal, and
what others have computed."""


def find(experiment_id: str) -> Experiment:
    """Return an experiment by name.

    Raises:
        LookupError: There is none of that name that can be used; the sentence says why, or lists those that there are.
    """
    if experiment_id in EXPERIMENTS:
        return EXPERIMENTS[experiment_id]
    broken = next((plugin for plugin in EXPERIMENTS.plugins if plugin.name == experiment_id), None)
    if broken is not None:
        raise LookupError(broken.report[:1].lower() + broken.report[1:])
    raise LookupError(f"there is no experiment {experiment_id!r}; there are {', '.join(EXPERIMENTS)}")


def find_for(kind: Kind) -> Experiment:
    """Return the first experiment that takes a kind of recording.

    Raises:
        LookupError: There is none.
    """
    found = next((one for one in EXPERIMENTS.values() if one.accepts_video and kind in one.video.footage), None)
    if found is None:
        raise LookupError(f"there is no experiment for a recording of {kind}")
    return found
