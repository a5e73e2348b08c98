"""The worker: the process that computes a session's run.

It imports neither FastAPI nor the database nor viser; the web process speaks to it in the vocabulary of `protocol`.

- `protocol`: commands, orders and events; `worker`: the process that carries them out;
- `run_tree`: the runs of one session, one per branch;
- `description`: descriptions of a run and drawings of its frames;
- `codec`: the binary form of drawings.
"""
