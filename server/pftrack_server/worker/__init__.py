"""The worker: the process that computes a session's run.

It imports neither FastAPI nor the database nor viser; the web process speaks to it in the vocabulary of `protocol`.

- `worker`: its loop; `run_tree`: the runs of one session, a branch each; `description`: what is fixed of them.
"""

__all__: list[str] = []
