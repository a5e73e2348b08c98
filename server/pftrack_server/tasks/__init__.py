"""Tasks: work on what people sent, each in a confined process, so that it harms nobody and nobody waits for it.

- `child_tasks`: how the web process has them carried out, `queue`: who is next, and `jobs`: those that are asked about;
- `functions`: what they do.
"""

__all__: list[str] = []
