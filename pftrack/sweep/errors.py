"""What is wrong with a sweep, in one sentence."""

__all__ = ["SweepError", "SweepStopped"]


class SweepError(ValueError):
    """A sweep that cannot be made, continued or read; the sentence says why and names both sides."""


class SweepStopped(Exception):  # noqa: N818 - somebody asked for it
    """The sweep was asked to stop; what was computed is kept."""
