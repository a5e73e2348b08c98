"""What experiments on the pose of a solid have in common: `series` they measure, and how they are drawn (`sketch`)."""

__all__: list[str] = []
