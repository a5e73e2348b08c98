"""The server: FastAPI on one port around sessions that each run in a worker process of their own.

It does no tracking mathematics. A *session* is a run that somebody watches; its worker computes, the web process passes
on: diagnostics to the page's stream, drawings to the viser scene, everything that a person made to the store.

- `core`: settings, with unsafe combinations refused; the one shape of errors; requests; base path; limits of the shell
- `store`: the database and the files beside it
- `jobs`: short work in confined processes, and longer work that can be followed
- `uploads`: what people send; `viewer`: the viser scene of a session
- `sessions`: runs that somebody watches, their streams, and the worker process that computes one
- `sweeps`, `work`: what people compute by the thousand, save, compare and export
- `web`: pages, middleware, health and serving; routes that have a subject lie beside it
- `app`: the factory that puts everything together; `command`: what `pftrack serve` calls
"""
