"""The view of a frame: what is drawn of the run that a worker shows, with what somebody looks at in it."""

import dataclasses

from pftrack.core.model.diagnostics import Diagnostics, Step
from pftrack.core.model.drawing import Drawing, Key, drawn_keys
from pftrack.core.model.faults import without_faults
from pftrack.core.model.palette import COLOURS
from pftrack.core.model.parameters import with_role
from pftrack.runs.run import Run
from pftrack_server.schemas.inspection import InspectionPublic, InspectionUpdate
from pftrack_server.worker.looking import Looking


class FrameView:
    """What is looked at, and what the legend has said so far."""

    def __init__(self) -> None:
        """Begin with nobody looking and an empty legend."""
        self._looking = Looking()
        self._legend: tuple[str, dict[tuple[str, Key], None]] = "", {}

    def draw(self, run: Run, other: Diagnostics | None) -> Drawing:
        """Return what is to be seen of the frame at which a run stands, without what no viewer can show.

        Args:
            run: The one that is shown.
            other: The same frame of another run, to compare with.
        """
        step = _step_to_draw(run)
        past = run.diagnostics[: step.frame.index + 1]
        drawing = without_faults(run.experiment.draw(step, past, other))
        if self._looking.is_drawn:
            drawing = self._looking.draw(run, drawing)
        drawn = dict.fromkeys(drawn_keys(drawing, run.experiment.layers))
        if self._legend[0] != step.tracker:
            self._legend = step.tracker, {}
        # What a method has drawn once stays in its legend, which would flicker otherwise; its first belief, which may
        # be of another kind than all that follow, does not.
        if step.frame.index > 0:
            self._legend[1].update(drawn)
        legend = sorted({**self._legend[1], **drawn}, key=lambda entry: list(COLOURS).index(entry[1].colour))
        return dataclasses.replace(drawing, legend=tuple(legend))

    def inspect(self, run: Run, wanted: InspectionUpdate) -> InspectionPublic:
        """Look at something in the frame at which a run stands, and draw it from now on.

        Raises:
            ParameterError: There is no such thing to look at; what was looked at before still is.
        """
        image = run.current.frame.image_rgb
        if image is None:
            step = _step_to_draw(run)
            drawing = run.experiment.draw(step, run.diagnostics[: step.frame.index + 1])
            return self._looking.look(run, wanted, (drawing.width, drawing.height))
        return self._looking.look(run, wanted, (image.shape[1], image.shape[0]))


def _step_to_draw(run: Run) -> Step:
    """Return the step that is shown, with what is only drawn as it is in force from the next frame on."""
    step, following = run.current, run.parameters_at(run.position + 1)
    shown = {item.name: getattr(following, item.name) for item in with_role(type(following), "drawing")}
    return dataclasses.replace(step, parameters=step.parameters.model_copy(update=shown)) if shown else step
