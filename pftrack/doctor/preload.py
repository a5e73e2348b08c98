"""Imports of the fork server for compiling processes: all experiments, once for all of them."""

from pftrack.doctor.compiling import compile_case
from pftrack.experiments import EXPERIMENTS

__all__ = ["compile_case"]

dict(EXPERIMENTS)
