"""The 3-D scene of a session and its panel, shown by viser through the server's one port.

A `Viewer` owns one viser server. It turns drawings into scene nodes (`scene`, `shapes`, `worlds`) and declarations of
parameters into controls (`panel`), frames the picture for each browser (`camera`) and lets people drag objects
(`dragging`). `local` shows a run without a session.

Only these use internals of viser:

- `viser_server`: a viser server in the web server's loop, without a port of its own; `bridge` connects a browser's
  websocket to it after the web application has checked the request
- `viser_messages`: filters a browser's messages to viser, and checks whether a browser keeps up
- `viser_handles`: already encoded pictures, and meshes with vertex colours, which viser offers only for files
- `client_page`: viser's client page, adapted to run at `/viz/{session}/` inside a session's page
- `client/`: the scripts and the style sheet inserted into that page; only they depend on the structure of viser's
  client

`tests/viewer` has a test for each internal that they rely on, in the installed Python package or in its client in a
real browser.
"""

from pftrack_server.viewer.client_page import CONTENT_SECURITY_POLICY, client_asset, client_page
from pftrack_server.viewer.viewer import Viewer
from pftrack_server.viewer.viser_server import Endpoint, bridge

__all__ = ["CONTENT_SECURITY_POLICY", "Endpoint", "Viewer", "bridge", "client_asset", "client_page"]
