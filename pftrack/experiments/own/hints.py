"""What each function of a filter's file gets and returns, in words for whoever writes one."""

from dataclasses import dataclass

from pftrack.experiments.own.code import FUNCTIONS

__all__ = ["HINTS", "Hint"]


@dataclass(frozen=True, slots=True)
class Hint:
    """What a function is for.

    Attributes:
        name: Of the function.
        arguments: Those that it may name.
        returns: What it must return, with shapes.
        about: One sentence.
    """

    name: str
    arguments: tuple[str, ...]
    returns: str
    about: str


_WORDS = {
    "start": ("states (N, d)", "Where particles begin, given where the target is in frame 0."),
    "propagate": ("states (N, d)", "Draws the next states from p(xₜ | xₜ₋₁)."),
    "propose": (
        "states (N, d), log_correction (N,)",
        "Draws the next states from a proposal q; the correction is log p(xₜ | xₜ₋₁) - log q(xₜ | xₜ₋₁, zₜ).",
    ),
    "log_likelihood": ("(N,)", "log p(zₜ | xₜ), up to a constant; -inf for what cannot be."),
    "should_resample": ("true or false", "Whether parents are drawn in this frame."),
    "resample": ("(N,) whole numbers", "Places of the parents; log_weights are of weights that sum to one."),
    "step": (
        "states (N, d), log_weights (N,)[, ancestors (N,)]",
        "A whole step in place of all but the first; log_weights need not sum to one.",
    ),
}

HINTS = tuple(Hint(name, arguments, *_WORDS[name]) for name, arguments in FUNCTIONS.items() if name in _WORDS)
"""All functions, in the order in which they are told."""
