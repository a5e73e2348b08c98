"""The 3-D scene of a session and its panel, shown by viser and reached through one port.

A `Viewer` owns one `ViserServer`: it turns drawings into scene nodes (`scene`, `nodes`, `shapes`, `bodies`, `worlds`,
`gltf`),
parameter declarations into controls (`panel`, `controls`), frames the picture for each browser (`camera`) and slows
down when a browser cannot follow (`pacing`). That server listens nowhere: `bridge` joins a browser's websocket to it
after the web application has checked who is asking, and `client_page` is viser's client, prepared to live at
`/viz/{session}/` inside the session's page. `viser_adapter` alone knows viser's private parts.
"""

from pftrack_server.viewer.bridge import bridge
from pftrack_server.viewer.viewer import Viewer
from pftrack_server.viewer.viser_adapter import CONTENT_SECURITY_POLICY, Endpoint, client_asset, client_page

__all__ = ["CONTENT_SECURITY_POLICY", "Endpoint", "Viewer", "bridge", "client_asset", "client_page"]
