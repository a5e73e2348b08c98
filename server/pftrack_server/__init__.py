"""The server: FastAPI on one port around sessions that each run in a worker process of their own.

It does no tracking mathematics. A *session* is a run that somebody watches; its worker computes, the web process passes
on: diagnostics to the page's stream, drawings to the viser scene, everything that a person made to the store.

- `settings`: how a server is configured, with unsafe combinations refused
- `app`, `services`: the factory that puts everything together, and what the handlers work with
- `command`: what `pftrack serve` calls; `resource_limits`: what its shell allows
- `errors`: the one shape of everything that goes wrong
- `middleware`: who may speak, and how much; what Prometheus may ask
- `api`: the REST handlers, the streams and the way to the scene; `api_docs`: their description
- `pages`: the dashboard's files; `documentation`: the help beside them
- `sessions`: runs that somebody watches; `worker`: the process that computes one; `stream`: what the pages hear of it
- `uploads`, `runs`, `sweeps`: what people send, save and compute by the thousand
- `tasks`: short work in confined processes
- `store`: the database and the files beside it
- `viewer`: the viser scene of a session
"""

__all__: list[str] = []
