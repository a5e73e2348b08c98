"""Sessions: runs that somebody watches, each computed by a worker process of its own.

The web process holds a session's spec (seed, timeline, position: enough to compute it again to the bit); the worker
computes it. A pipe with a small vocabulary connects the two, and a stream connects the web process to the pages.

- `manager`: all sessions, and the housekeeping around them
- `create`: from a request to the spec of a new session
- `session`, `state`: one session in the web process
- `scene_feed`: feeds the viser scene and takes the commands of its panel
- `worker_handle`: the web process's side of a worker
"""
