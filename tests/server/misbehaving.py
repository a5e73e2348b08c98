"""Experiments of other packages that do not run, or draw what cannot be shown."""

FAILING = """
from dataclasses import replace
from pftrack.experiments import find

def simulate():
    raise RuntimeError("no scene in this house")

EXPERIMENT = replace(find("sine"), id="failing", simulate=simulate, interface=4)
"""

SCRIBBLING = """
import math
from dataclasses import replace
from pftrack.experiments import find

SINE = find("sine")

def draw(step, past, other=None):
    drawn = SINE.draw(step, past, other)
    width = math.nan if step.diagnostics.frame >= 2 else 2.0
    return replace(drawn, primitives={**drawn.primitives, "now": replace(drawn.primitives["now"], width=width)})

EXPERIMENT = replace(SINE, id="scribbling", draw=draw, interface=4)
"""
