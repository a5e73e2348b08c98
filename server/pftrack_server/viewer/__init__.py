"""The 3-D scene of a session and its panel, shown by viser and reached through one port.

A `Viewer` owns one viser server: it turns drawings into scene nodes (`scene`, `shapes`, `worlds`), declarations of
parameters into controls (`panel`), frames the picture for each browser (`camera`) and lets people move what is in it
(`dragging`). `local` shows a run without a
session.

These alone touch what viser does not promise:

- `viser_server`: a viser server in the web server's loop, which listens nowhere; `bridge` joins a browser's websocket
  to it after the web application has checked who is asking
- `viser_messages`: what a browser may say, what viser must not hear, and the question whether a browser keeps up
- `viser_handles`: pictures that are encoded already, and meshes with colours of vertices, which viser has in files only
- `client_page`: viser's client, taken apart and prepared to live at `/viz/{session}/` inside a session's page
- `client/`: the scripts and the style sheet that are put into that page; nothing else knows how viser's client is built

`tests/viewer` has a test for each thing that they rest on, which fails with a sentence saying what has changed, in the
installed Python package or in its client in a real browser.
"""

from pftrack_server.viewer.client_page import CONTENT_SECURITY_POLICY, client_asset, client_page
from pftrack_server.viewer.viewer import Viewer
from pftrack_server.viewer.viser_server import Endpoint, bridge

__all__ = ["CONTENT_SECURITY_POLICY", "Endpoint", "Viewer", "bridge", "client_asset", "client_page"]
