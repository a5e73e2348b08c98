"""Sessions: runs that somebody watches, each computed by a worker process of its own.

The web process knows what a session *is* (`spec`: seed, timeline, position; enough to make it again to the bit), the
worker computes it. Between them runs a pipe with a small vocabulary; from the web process to the pages a stream.

- `manager`: all sessions, and the housekeeping around them
- `session`, `chronicle`, `view`, `spec`, `history`: one session as the web process knows it
- `listeners`, `messages`: the stream to the pages
- `stage`: the viser scene
- `link`, `pipe`, `protocol`: the worker as the web process sees it
- `forkserver`, `preload`, `limits`: how a worker comes to be, in milliseconds and confined
- `worker`, `workbench`: what it does
- `errands`, `jobs`: short work in confined processes
"""

__all__: list[str] = []
