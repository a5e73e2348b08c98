"""The 3-D scene of a session and its panel, shown by viser and reached through one port.

A `Viewer` owns one `ViserServer`: it turns drawings into scene nodes (`scene`, `nodes`, `shapes`, `worlds`), parameter
declarations into controls (`panel`) and frames the picture for each browser (`camera`). That server listens nowhere and
works in the web server's loop: `bridge` joins a browser's websocket to it after the web application has checked who is
asking, and `client_page` is viser's client, prepared to live at `/viz/{session}/` inside the session's page.
`viser_adapter` alone knows viser's private parts.
"""

from pftrack_server.viewer.viewer import Viewer
from pftrack_server.viewer.viser_adapter import CONTENT_SECURITY_POLICY, Endpoint, bridge, client_asset, client_page

__all__ = ["CONTENT_SECURITY_POLICY", "Endpoint", "Viewer", "bridge", "client_asset", "client_page"]
