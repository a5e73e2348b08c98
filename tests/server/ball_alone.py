"""What a forkserver has ready that is asked for the ball alone: warming every experiment takes 4 s of processor time.

A server imports this in the place of `server.worker.preload` where the matter of a test is not what workers have ready.
"""

from pftrack import warming

warming.ready = lambda names: frozenset(names) & {"ball"}  # type: ignore[assignment]

import server.worker.preload  # noqa: E402, F401 - warms what is ready
