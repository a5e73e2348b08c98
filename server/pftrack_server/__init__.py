"""The server: FastAPI on one port around sessions that each run in a worker process of their own.

It does no tracking mathematics. A *session* is a run that somebody watches; Its worker computes. The web process sends
diagnostics to the page's stream, drawings to the viser scene, and everything that a person made to the store.

- `core`: settings (unsafe combinations are refused), the one shape of errors, requests, base path, limits of the shell
- `store`: the database and the files beside it
- `jobs`: short tasks in confined processes, and longer jobs with progress
- `uploads`: what people send; `viewer`: the viser scene of a session
- `sessions`: runs that somebody watches, their streams, and the worker process that computes one
- `sweeps`, `work`: runs computed by the thousand, saved, compared and exported
- `web`: pages, middleware, health and serving; other routes lie next to their subject
- `app`: the factory that puts everything together; `command`: the command `pftrack serve`
"""
