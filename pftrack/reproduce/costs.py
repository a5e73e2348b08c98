"""What the results cost, so that the cheap ones come first and a bar can say how long is left."""

__all__ = ["SECONDS"]

SECONDS: dict[str, tuple[float, float]] = {}
"""Processor time in the quick form and in the full one, s, as measured on one core."""
