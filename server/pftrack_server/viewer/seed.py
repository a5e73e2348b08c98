"""The box of the panel that shows the seed of the run, and takes another one, with which the run starts again."""

from collections.abc import Callable

import viser

from pftrack.core.model.parameters import Value
from pftrack.core.numerics.random import LARGEST_SEED
from pftrack_server.viewer.controls import Handle

SEED = "seed of the run"
"""What the panel calls it beside the parameters, whose names have no spaces."""


class SeedBox:
    """The box; like every control it proposes, and shows what the session says.

    Args:
        server: Where it is shown.
        seed: What it shows at first.
        on_move: Called with another seed when a person has typed one.

    Attributes:
        seed: What the session says.
    """

    def __init__(self, server: viser.ViserServer, seed: int, on_move: Callable[[Value], None]) -> None:
        self.seed = seed
        hint = "The same seed gives the same scene and the same run, to the bit. A change starts the run again."
        self._box: Handle = server.gui.add_number("Seed", seed, min=0, max=LARGEST_SEED, step=1, hint=hint)

        async def on_change(event: viser.GuiEvent[viser.GuiNumberHandle[int]]) -> None:
            if event.client_id is not None:
                on_move(_whole(event.target.value))

        self._box.on_update(on_change)

    def show(self, *, insist: bool = False) -> None:
        """Show the seed, even if it is believed to be shown already when `insist` is given."""
        if insist and self._box.value == self.seed:
            self._box.value = self.seed ^ 1
        self._box.value = self.seed


def _whole(value: Handle) -> Value:
    """Return what a browser has sent as a whole number if it is one; JavaScript has but one kind of numbers."""
    return int(value) if isinstance(value, float) and value.is_integer() else value
