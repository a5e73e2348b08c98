"""The one place that touches viser's private parts; the rest of the server uses viser's public interface and this.

- `server`: a viser server in the web server's loop, reached by an endpoint in place of the port that viser would open
- `messages`: what a browser may say, what viser must not hear, and the question whether a browser keeps up
- `handles`: pictures that are encoded already, and meshes with colours of vertices, which viser has in files only
- `client_page`: viser's client, taken apart and prepared to live inside a session's page
- `client/`: the scripts and the style sheet that are put into that page; nothing else knows how viser's client is built

Each of these rests on something that viser does not promise. `tests/viewer/viser_adapter` has a test for each that
fails with a sentence saying what has changed, in the installed Python package or in its client in a real browser.

Another version of viser is let in (`pyproject.toml`, where 1.1 is the only one) in this order. 1.2 is not published
yet; how it is likely to differ is taken from what changed between 1.0.21 and 1.1.1.

1. `test_server`: viser must open its port by `websockets.asyncio.server.serve`, use four members of a connection, and
   make its event loop by `asyncio.new_event_loop`, in which it runs one coroutine. The first two were the same in
   1.0.21. A version that opens its port otherwise is refused when a server is started. The endpoint could go if viser
   took a transport of the caller's.
2. `test_contracts`: the only clock in `viser.infra._infra` times messages (the same in 1.0.21), so it may run fast; it
   could go with an option that turns smoothing off. New kinds of messages from browsers have to be judged. A client
   that is packed in another way is served in one piece until `client_page` learns the new way.
3. `test_client_in_browser`: `__viserMutable`, `drainMessageQueue` and `messageQueue` are not in 1.0.21 at all, so these
   are what a new version is most likely to change; `client/frames.js` and `client/state.js` are then to be adapted.
   `client/colours.js` rests on `onBeforeRender` of the scene and on the bytes that points keep as their colours; with a
   viser whose meshes take colours of vertices in place, it and `ColouredMesh` can go. What `style.css`, `numbers.js`
   and `folds.js` look for are names of the library that draws the panel (mantine), and of its icons.
"""

from pftrack_server.viewer.viser_adapter.client_page import (
    CONTENT_SECURITY_POLICY,
    client_asset,
    client_page,
)
from pftrack_server.viewer.viser_adapter.handles import ColouredMesh, add_jpeg, replace_jpeg
from pftrack_server.viewer.viser_adapter.server import Connection, Endpoint, bridge, connection_of, start

__all__ = [
    "CONTENT_SECURITY_POLICY",
    "ColouredMesh",
    "Connection",
    "Endpoint",
    "add_jpeg",
    "bridge",
    "client_asset",
    "client_page",
    "connection_of",
    "replace_jpeg",
    "start",
]
