"""The lawn of the lecture's last lesson: its table of successes, and the switching filters on the same likelihood."""

__all__: list[str] = []
