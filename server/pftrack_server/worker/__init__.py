"""The worker: the process that computes a session's run.

It imports neither FastAPI nor the database nor viser; the web process speaks to it in the vocabulary of `protocol`.

- `worker`: its loop; `run_tree`: the runs of one session, a branch each; `wiring`: what their recipe speaks of, here;
- `description`: what is fixed of them; `timeline_view`: what has changed in one; `frame_view`: what is drawn of it;
- `particle_limit`, `filter_versions`: what changes and files may bring.
"""

__all__: list[str] = []
