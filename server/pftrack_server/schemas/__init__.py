"""What classes and lessons are asked and answer."""

__all__: list[str] = []
