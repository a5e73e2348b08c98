"""Tasks: short work on what people sent, in confined processes (`child_tasks`), and the functions that do it."""

__all__: list[str] = []
