"""The worker: the process that computes a session's run.

It imports neither FastAPI nor the database nor viser; the web process speaks to it in the vocabulary of `protocol`.

- `protocol`: all that can be asked of a run, and what is said of it; `worker`: the process that carries it out;
- `run_tree`: the runs of one session, a branch each;
- `description`: what is told of a run and what is drawn of its frames;
- `codec`: how a drawing travels to pages.
"""
