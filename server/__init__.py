"""The server: FastAPI on one port around sessions that each run in a worker process of their own.

It does no tracking mathematics. A *session* is a run that somebody watches; its worker computes, the web process passes
on: diagnostics to the page's stream, drawings to the viser scene, everything that a person made to the store.

- `settings`: what a server may be told, with unsafe combinations refused
- `app`: the factory that puts everything together
- `command`: what `pftrack serve` calls
- `security`: Host, Origin and token, and the headers of every answer
- `api`: the REST handlers and the stream
- `beginning`, `saving`, `uploading`: from a wish to a session, from a session to a record, from a body to a file
- `sessions`: session, manager, worker process and the pipe between them
- `store`: the database and the files beside it
- `viewer`: the viser scene of a session
"""

__all__: list[str] = []
