"""Experiments: source, tracker, parameters, drawing and measure wired together under a name.

Each experiment is a folder next to this file and a line of the list below; other packages add theirs by entry point.
Everything else (command line, server, sweeps) finds an experiment through `find` or `EXPERIMENTS`, which import it on
demand. `shared` holds code of several experiments, `own` the filters in a user's own file.

- `ball`: switching particle filters on a ball behind an occluder (Bando 2007, ch. 3);
- `fish`: a fish that bends, by a filter that is guided by learned changes (Mitsugami et al. 2009);
- `hand`: the pose of a hand by its silhouette, by several hypotheses (Shimada 1997);
- `head`: the pose of a head by its features, simulated or on a recording (Bando 2007, ch. 4);
- `histogram`: a window followed by its colours, past a look-alike and behind a column (Kagami 2012);
- `linkage`: a chain of three links, whose lengths and depth are estimated from one camera (Shimada 1997);
- `prism`: a solid's pose by adaptive sampling of its corners (Bando 2007, ch. 4);
- `recorded`: results of other loops and trackers, shown like any run;
- `sine`: the Kalman filter and the particle filter on a signal in noise (Bando 2007, ch. 2);
- `structure`: the shape of a body from tracks of its points (Bando 2007, ch. 4 section 5);
- `trajectories`: points followed through outliers, each independently (Ichimura and Ikoma).
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Annotated

from pydantic import Field, computed_field

from pftrack.core.model.preset import Preset
from pftrack.core.model.series import Plot, Reading
from pftrack.core.model.setup import Setup
from pftrack.core.model.source import Kind
from pftrack.core.model.tracker import Step
from pftrack.core.refusal import ParameterError, RefusedError
from pftrack.experiments.experiment import INTERFACE, Experiment

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

# The registry: experiments by name, each imported when it is first asked for.
#
# The project's own experiments are listed as addresses, `module:ATTRIBUTE`. Other packages add theirs by an entry point
# of the group `pftrack.experiments`, whose name is the experiment's id. Code from other packages may be broken in any
# way, so it is checked first. Unusable experiments are left out with the reason, and do not affect the others.

GROUP = "pftrack.experiments"

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
"""Pattern of an id, which becomes part of addresses and file names."""


@dataclass(frozen=True, slots=True)
class Plugin:
    """An experiment that another package adds, or fails to add.

    Attributes:
        name: The entry point's, which is to be the experiment's id.
        package: Name and version of the distribution.
        reason: Why the experiment cannot be used, a clause; empty if it can.
        detail: Text of the exception, if one was the reason. It may name files of this machine, so no answer has it.
    """

    name: str
    package: str
    reason: Annotated[str, Field(exclude=True)] = ""
    detail: Annotated[str, Field(exclude=True)] = ""

    @computed_field  # type: ignore[prop-decorator]
    @property
    def problem(self) -> str:
        """Why it cannot be used, one sentence; empty if it can."""
        return f"The experiment {self.name} of {self.package} cannot be used: {self.reason}." if self.reason else ""

    @property
    def report(self) -> str:
        """The problem with the exception's text, for the administrator."""
        return f"{self.problem.removesuffix('.')}: {self.detail}" if self.detail else self.problem


class Registry(Mapping[str, Experiment]):
    """All usable experiments, by id: the project's own in their order, then those of other packages."""

    def __init__(self, own: Mapping[str, str]) -> None:
        """List experiments without importing any.

        Args:
            own: Addresses of the project's own, `module:ATTRIBUTE`, by id.
        """
        self.own = own
        self._known: dict[str, Experiment] = {}
        self._examined: dict[tuple[str, ...], Experiment | Plugin] = {}

    def __getitem__(self, name: str) -> Experiment:
        if name not in self._known:
            self._known[name] = self._load(name)
        return self._known[name]

    def __iter__(self) -> Iterator[str]:
        yield from self.own
        yield from (plugin.name for plugin in self.plugins if not plugin.reason)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def plugins(self) -> tuple[Plugin, ...]:
        """All experiments of other packages, including unusable ones; this imports them."""
        outcomes = [(entry, self._examine(entry)) for entry in self._entries]
        return tuple(
            outcome if isinstance(outcome, Plugin) else Plugin(entry.name, _package(entry))
            for entry, outcome in outcomes
        )

    @cached_property
    def _entries(self) -> tuple[EntryPoint, ...]:
        """Experiments of other packages, in an order that does not depend on how they are found."""
        return tuple(sorted(entry_points(group=GROUP), key=_key))

    def _load(self, name: str) -> Experiment:
        if name in self.own:
            module, _, attribute = self.own[name].partition(":")
            experiment: Experiment = getattr(import_module(module), attribute)
            experiment.check_starts()
            return experiment
        for entry in self._entries:
            if entry.name == name and isinstance(outcome := self._examine(entry), Experiment):
                return outcome
        raise KeyError(name)

    def _examine(self, entry: EntryPoint) -> Experiment | Plugin:
        """Return an entry point's experiment, or why it cannot be used; it is imported at most once."""
        key = _key(entry)
        if key not in self._examined:
            first = next(other for other in self._entries if other.name == entry.name)
            if entry.name in self.own or first is not entry:
                holder = "pftrack itself" if entry.name in self.own else _package(first)
                self._examined[key] = Plugin(entry.name, _package(entry), f"its name is taken by {holder}")
            else:
                self._examined[key] = _admit(entry)
        return self._examined[key]


def _admit(entry: EntryPoint) -> Experiment | Plugin:
    def refuse(reason: str, detail: str = "") -> Plugin:
        return Plugin(entry.name, _package(entry), reason, detail)

    if not NAME.fullmatch(entry.name):
        return refuse("its name must be at most 64 lower-case letters, digits, hyphens and underscores")
    try:
        experiment = entry.load()
    except (Exception, SystemExit) as error:  # noqa: BLE001 - what a foreign import may raise is open
        return refuse(f"importing it raises {type(error).__name__}", " ".join(str(error).split()))
    if not isinstance(experiment, Experiment):
        return refuse(
            f"{entry.value} must be a pftrack.experiments.experiment.Experiment, got {type(experiment).__name__}"
        )
    if experiment.interface != INTERFACE:
        stated = f"version {experiment.interface}" if experiment.interface else "no version"
        return refuse(f"it states {stated} of the interface, and this pftrack has version {INTERFACE}")
    if experiment.id != entry.name:
        return refuse(f"its id {experiment.id!r} differs from the name of its entry point")
    return experiment


def _key(entry: EntryPoint) -> tuple[str, ...]:
    return entry.name, _package(entry), entry.value


def _package(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown package"


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
"""All experiments by name, in display order: places, poses, shapes, a signal, and results of other programs."""


def find(experiment_id: str) -> Experiment:
    """Return an experiment by name.

    Raises:
        RefusedError: The experiment is unknown or cannot be used; the sentence lists the usable ones, or gives the
            reason.
    """
    if experiment_id in EXPERIMENTS:
        return EXPERIMENTS[experiment_id]
    broken = next((plugin for plugin in EXPERIMENTS.plugins if plugin.name == experiment_id), None)
    if broken is not None:
        raise RefusedError(broken.report[:1].lower() + broken.report[1:], "experiment", value=experiment_id)
    raise ParameterError("experiment", experiment_id, f"one of {', '.join(EXPERIMENTS)}")


def find_for(kind: Kind) -> Experiment:
    """Return the first experiment that takes a kind of recording.

    Raises:
        RefusedError: No experiment takes it.
    """
    found = next((one for one in EXPERIMENTS.values() if one.accepts_video and kind in one.video.footage), None)
    if found is None:
        raise RefusedError(f"no experiment takes a recording of {kind}")
    return found
