"""Measuring a frame: what tracker and experiment report of it, without what is no measurement.

Experiments of other packages measure, too, and a run is worth more than one of its series. What fails, or is not of the
shape that was declared, is missing from the frame, as where a method does not have it; the log says so, once.
"""

from collections.abc import Callable, Mapping

from pftrack.core.model.frame import Frame
from pftrack.core.model.series import Series, SeriesValue, check_value
from pftrack.core.model.suitability import BESIDE
from pftrack.core.model.tracker import Tracker, TrackState
from pftrack.core.once import warn_once
from pftrack.experiments.experiment import Experiment

__all__ = ["measurements"]


def measurements(
    experiment: Experiment,
    declared: Mapping[str, Series],
    tracker: Tracker,
    frame: Frame,
    state: TrackState,
    beside: Callable[[], float] | None = None,
) -> dict[str, SeriesValue]:
    """Return what was measured of a frame, by name.

    Args:
        experiment: Whose `measure` comes after the tracker's.
        declared: All series of the experiment, by name.
        tracker: What has computed the state.
        frame: What was seen.
        state: What is believed.
        beside: How the target separates from its surroundings, where that is measured.
    """
    kept = _usable(f"{experiment.id}, {tracker.id}", declared, lambda: tracker.measure(state), frame)
    if (measure := experiment.measure) is not None:
        kept |= _usable(experiment.id, declared, lambda: measure(frame, state), frame)
    if beside is not None:
        kept |= _usable(experiment.id, declared, lambda: {BESIDE.name: beside()}, frame)
    return kept


def _usable(
    whose: str, declared: Mapping[str, Series], measure: Callable[[], Mapping[str, SeriesValue]], frame: Frame
) -> dict[str, SeriesValue]:
    what = f"the `measure` of {whose}"
    where = f"in frame {frame.index}; this is left out, here and later, and the run goes on"
    try:
        reported = dict(measure())
    except Exception as error:  # noqa: BLE001 - it is another package's
        warn_once(what, f"{what} failed {where}", error)
        return {}
    kept: dict[str, SeriesValue] = {}
    for name, value in reported.items():
        try:
            check_value(_find_series(declared, name), value)
        except (TypeError, ValueError) as error:
            warn_once(f"{what}: {name}", f"{what} is not usable {where}: {error}")
        else:
            kept[name] = value
    return kept


def _find_series(declared: Mapping[str, Series], name: str) -> Series:
    if name not in declared:
        raise ValueError(f"nobody declares a series {name!r}")
    return declared[name]
