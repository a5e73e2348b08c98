"""Sessions: runs that somebody watches, each computed by a worker process of its own.

The web process knows what a session *is* (its spec: seed, timeline, position; enough to compute it again to the bit),
the worker computes it. Between them runs a pipe with a small vocabulary; from the web process to the pages a stream.

- `manager`: all sessions, and the housekeeping around them
- `create`: from a request to the spec of a new session
- `session`, `state`: one session as the web process knows it
- `scene_feed`: the viser scene, and the commands of its panel
- `worker_handle`: the worker as the web process sees it
"""
