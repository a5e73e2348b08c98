"""What an experiment declares of the probability that its trackers have lost their target."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pftrack.core.model.series import Series
from pftrack.core.model.tracker import Tracker
from pftrack.experiments.shared.loss_probability.logistic import Logistic
from pftrack.experiments.shared.loss_probability.model import LossModel
from pftrack.experiments.shared.loss_probability.scenes import Scenes

__all__ = [
    "LOSS_PROBABILITY",
    "MOST_ERROR",
    "NOTHING_DECLARED",
    "LossDeclaration",
    "describe_models",
    "read_declaration",
    "write_models",
]

LOSS_PROBABILITY = Series(
    "loss_probability",
    "probability that the target is lost",
    role="loss_probability",
)
"""Of each tracker that has a model; what general code does with it, it does by its role."""

MOST_ERROR = 0.05
"""Expected calibration error in scenes that were not fitted above which none is declared."""

FORMAT, DIGITS = "pftrack-loss", 6


@dataclass(frozen=True)
class LossDeclaration:
    """Of which trackers it is declared, and how that was fitted.

    Attributes:
        scenes: On which it is fitted and judged; None where nothing was.
        signals: Names of series that are signals beside those of every tracker.
        models: By name of the tracker, of those whose probability is true in scenes that were not fitted.
        refused: By name of the tracker, the expected calibration error in scenes that were not fitted, of those that
            have none because it is too great.
    """

    scenes: Scenes | None = None
    signals: tuple[str, ...] = ()
    models: Mapping[str, LossModel] = field(default_factory=dict)
    refused: Mapping[str, float] = field(default_factory=dict)

    def models_on(self, recording: object | None) -> Mapping[str, LossModel]:
        """Return the models by name of the tracker; none on a recording, where they are not calibrated.

        Args:
            recording: The recording or its kind; None in the simulated scene.
        """
        return self.models if recording is None else {}


NOTHING_DECLARED = LossDeclaration()
"""Of an experiment none of whose trackers can tell."""


def describe_models(
    models: Mapping[str, LossModel], refused: Mapping[str, float], about: Mapping[str, Any]
) -> dict[str, Any]:
    """Return models as JSON values.

    Args:
        models: By name of the tracker.
        refused: The calibration error of those trackers of which none is kept.
        about: What they were fitted on, JSON values.
    """
    trackers = {name: {"signals": one.signals, **_rounded(asdict(one.regression))} for name, one in models.items()}
    return {**about, "refused": _rounded(refused), "trackers": trackers}


def write_models(described: Mapping[str, Any]) -> str:
    """Return the text of a file, by what `describe_models` says."""
    return json.dumps({"format": FORMAT, "version": 1, **described}, indent=1) + "\n"


def read_declaration(
    path: Path, trackers: Mapping[str, Tracker], scenes: Scenes, signals: tuple[str, ...] = ()
) -> LossDeclaration:
    """Return what is declared by the models in a file.

    Args:
        path: Of the file.
        trackers: Those of which it speaks, by name.
        scenes: On which they were fitted and judged.
        signals: Names of series that are signals beside those of every tracker.

    Raises:
        ValueError: The file holds something else, or speaks of a tracker that is not there.
    """
    try:
        models, refused = _models(_raw(path), trackers)
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"{path.name} is no file of loss probabilities ({type(error).__name__}: {error})") from None
    return LossDeclaration(scenes, signals, models, refused)


def _raw(path: Path) -> dict[str, Any]:
    raw: dict[str, Any] = json.loads(path.read_text("utf-8"))
    if (raw["format"], raw["version"]) != (FORMAT, 1):
        raise ValueError(f"expected {FORMAT}, version 1")
    return raw


def _models(raw: Mapping[str, Any], trackers: Mapping[str, Tracker]) -> tuple[dict[str, LossModel], dict[str, float]]:
    models = {name: _model(values, trackers[name].series) for name, values in raw["trackers"].items()}
    return models, {trackers[name].id: float(error) for name, error in raw["refused"].items()}


def _model(values: Mapping[str, Any], series: tuple[Series, ...]) -> LossModel:
    numbers = {name: tuple(float(one) for one in values[name]) for name in ("means", "deviations", "weights")}
    if len({len(column) for column in numbers.values()}) != 1:
        raise ValueError("means, deviations and weights are not as many")
    regression = Logistic(**numbers, intercept=float(values["intercept"]))
    return LossModel(tuple(values["signals"]), regression, {one.name: one for one in series})


def _rounded(values: Mapping[str, Any]) -> dict[str, Any]:
    def shorten(value: float) -> float:
        return float(f"{value:.{DIGITS}g}")

    return {
        name: shorten(value) if isinstance(value, float) else [shorten(one) for one in value]
        for name, value in values.items()
    }
