"""What a source says when it cannot be used."""

__all__ = ["SourceError"]


class SourceError(ValueError):
    """A sequence of pictures that cannot be used; the message is one sentence: what was wrong, what is allowed."""
