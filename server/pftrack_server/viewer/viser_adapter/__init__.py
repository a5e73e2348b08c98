"""The one place that touches viser's private parts; the rest of the server uses viser's public interface and this.

- `server`: how a viser server is started and stopped here
- `endpoint`: connections to it within this process, in place of the port that viser would open
- `loops`: the event loop in which it works, that of the web server
- `echo`: a browser's answer, awaited in that loop
- `clock`: no smoothing of the stream
- `pictures`: pictures that are encoded already
- `messages`: what a browser may say, and what viser must not hear
- `coloured_mesh`: meshes with colours of vertices, which viser has in files only
- `client_page`, `client_bundle`: viser's client, taken apart and prepared to live inside a session's page
- `client/`: the scripts and the style sheet that are put into that page; nothing else knows how viser's client is built

Each of these rests on something that viser does not promise. `tests/viewer/viser_adapter` has a test for each that
fails with a sentence saying what has changed, in the installed Python package or in its client in a real browser.

Another version of viser is let in (`pyproject.toml`, where 1.1 is the only one) in this order. 1.2 is not published
yet; how it is likely to differ is taken from what changed between 1.0.21 and 1.1.1.

1. `test_endpoint`: viser must open its port by `websockets.asyncio.server.serve` and use four members of a connection.
   That was the same in 1.0.21. A version that does otherwise is refused when a server is started, so that no port is
   opened. The endpoint could go if viser took a listening socket or a server of the caller's.
2. `test_loops`: viser must make its event loop by `asyncio.new_event_loop` and run one coroutine in it. A viser that
   works otherwise works in threads of its own, or is not started.
3. `test_contracts`: the only clock in `viser.infra._infra` times messages (the same in 1.0.21), so it may run fast; it
   could go with an option that turns smoothing off. New kinds of messages from browsers have to be judged. A client
   that is packed in another way is served in one piece until `client_bundle` learns the new way.
4. `test_client_in_browser`: `__viserMutable`, `drainMessageQueue` and `messageQueue` are not in 1.0.21 at all, so these
   are what a new version is most likely to change; `client/frames.js` and `client/state.js` are then to be adapted.
   `client/colours.js` rests on `onBeforeRender` of the scene and on the bytes that points keep as their colours; with a
   viser whose meshes take colours of vertices in place, it and `coloured_mesh` can go. What `style.css`, `numbers.js`
   and `folds.js` look for are names of the library that draws the panel (mantine), and of its icons.
"""

from pftrack_server.viewer.viser_adapter.client_page import (
    CONTENT_SECURITY_POLICY,
    client_asset,
    client_page,
)
from pftrack_server.viewer.viser_adapter.coloured_mesh import ColouredMesh
from pftrack_server.viewer.viser_adapter.echo import echo
from pftrack_server.viewer.viser_adapter.endpoint import Connection, Endpoint
from pftrack_server.viewer.viser_adapter.messages import is_allowed
from pftrack_server.viewer.viser_adapter.pictures import add_jpeg, replace_jpeg
from pftrack_server.viewer.viser_adapter.server import connection_of, start, stop

__all__ = [
    "CONTENT_SECURITY_POLICY",
    "ColouredMesh",
    "Connection",
    "Endpoint",
    "add_jpeg",
    "client_asset",
    "client_page",
    "connection_of",
    "echo",
    "is_allowed",
    "replace_jpeg",
    "start",
    "stop",
]
