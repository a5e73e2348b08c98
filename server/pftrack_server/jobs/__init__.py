"""Jobs: work on what people sent, each in a confined process, so that it harms nobody and nobody waits for it.

- `child_tasks`: how the web process has work carried out, and who is next;
- `jobs`: work that is followed by its id, and `results`: what was computed once and is kept;
- `functions`: what the confined processes do with uploads and experiments.
"""
