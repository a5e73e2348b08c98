"""Pieces of work of studies, made small in the process that computes them."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any
from unittest.mock import patch

from pftrack.reproduce import fish, head, prism, structure
from pftrack.runs.run import Run

HEAD_FRAMES = 40


def compute(function: Callable[[Any], Any], item: Any) -> Any:
    """Compute a piece on short scenes and with few particles: all of its code is run, for a part of the time."""
    if isinstance(item, prism.Trial):
        item = replace(item, values={"joint_sample_count": 500, **item.values})
    elif function is fish.follow:
        clip, conditions, _ = item
        item = clip, tuple(condition._replace(particles=20) for condition in conditions), 1
    with ExitStack() as stack:
        stack.enter_context(patch.object(fish, "FRAMES", 12))
        stack.enter_context(patch.object(head, "SCRIPT_FRAMES", HEAD_FRAMES))
        stack.enter_context(patch.object(prism, "Run", partial(Run, frames=200)))  # a vertex hides for 60 of them
        stack.enter_context(patch.dict(structure.head_tracks.__kwdefaults__, frames=structure.WINDOW + 10))
        return function(item)
