"""The server: FastAPI on one port around sessions that each run in a worker process of their own.

It does no tracking mathematics. A *session* is a run that somebody watches; its worker computes, the web process passes
on: diagnostics to the page's stream, drawings to the viser scene, everything that a person made to the store.

- `settings`: what a server may be told, with unsafe combinations refused
- `app`, `services`: the factory that puts everything together, and what the handlers work with
- `command`: what `pftrack serve` calls
- `security`, `body`, `errors`: who may speak, how much, and the one shape of everything that goes wrong
- `api`: the REST handlers, the stream and the scene's door
- `pages`, `reference`: the dashboard's files, and the description of the interface
- `beginning`, `saving`, `uploading`: from a wish to a session, from a session to a record, from a body to a file
- `sessions`: session, manager, worker process and the pipe between them
- `store`: the database and the files beside it
- `metrics`: what Prometheus may ask
- `viewer`: the viser scene of a session
"""

__all__: list[str] = []
