"""The limit of particles: how many a run may hold at once on this server, whatever its timeline brings."""

from collections.abc import Mapping

from pftrack.core.model.parameters import Parameters, flat, limit_particles, revise
from pftrack.core.model.recipe import Recipe, parameter_values
from pftrack.experiments.experiment import Experiment


def limit_change(
    experiment: Experiment, parameters: Parameters, tracker: str, values: Mapping[str, object], most: int
) -> tuple[Parameters, str]:
    """Return parameters and tracker after a change.

    Args:
        experiment: Of the run.
        parameters: In force before.
        tracker: Name of the tracker before.
        values: The change.
        most: How many particles are allowed.

    Raises:
        ParameterError: A value is refused, or there would be too many particles.
    """
    tracker = str(values.get("tracker", tracker))
    changed = revise(parameters, parameter_values(values))
    limit_particles(experiment.declarations(type(changed)), flat(changed), tracker, most)
    return changed, tracker


def limit_recipe(experiment: Experiment, parameters: Parameters, recipe: Recipe, most: int) -> None:
    """Refuse a recipe that has too many particles in any of its frames.

    Args:
        experiment: That of the recipe.
        parameters: Of its setup.
        recipe: The recipe.
        most: How many particles are allowed.

    Raises:
        ParameterError: A value is refused, or there would be too many particles.
    """
    changes: dict[int, dict[str, object]] = {0: {}}
    for change in recipe.timeline:
        changes.setdefault(change.frame, {}).update(change.values)
    tracker = recipe.tracker or experiment.default_tracker
    for frame in sorted(changes):
        parameters, tracker = limit_change(experiment, parameters, tracker, changes[frame], most)
