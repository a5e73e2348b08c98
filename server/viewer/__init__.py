"""The 3-D scene of a session and its panel, shown by viser and reached through one port.

A `Viewer` owns one `ViserServer` on the loopback interface: it turns drawings into scene nodes (`scene`, `shapes`),
parameter declarations into controls (`panel`, `controls`), frames the picture for each browser (`camera`) and slows
down when a browser cannot follow (`pacing`). Nobody reaches that server directly: `bridge` joins a browser's websocket
to it after the web application has checked who is asking, and `client_page` is viser's client, prepared to live at
`/viz/{session}/` inside the session's page.
"""

from server.viewer.bridge import bridge
from server.viewer.client import CONTENT_SECURITY_POLICY, client_asset, client_page
from server.viewer.viewer import Viewer

__all__ = ["CONTENT_SECURITY_POLICY", "Viewer", "bridge", "client_asset", "client_page"]
