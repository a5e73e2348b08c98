"""The one place that touches viser's private parts; the rest of the server uses viser's public interface and this.

- `server`: how a viser server is started and stopped here
- `endpoint`: connections to it within this process, in place of the port that viser would open
- `clock`: no smoothing of the stream
- `messages`: what a browser may say, and what viser must not hear
- `client_page`, `client_bundle`: viser's client, taken apart and prepared to live inside a session's page
- `client/`: the scripts and the style sheet that are put into that page; nothing else knows how viser's client is built

Each of these rests on something that viser does not promise. `tests/viewer/viser_adapter` has a test for each that
fails with a sentence saying what has changed.
"""

from server.viewer.viser_adapter.client_page import CONTENT_SECURITY_POLICY, client_asset, client_page
from server.viewer.viser_adapter.endpoint import Connection, Endpoint
from server.viewer.viser_adapter.messages import is_welcome
from server.viewer.viser_adapter.server import start, stop

__all__ = [
    "CONTENT_SECURITY_POLICY",
    "Connection",
    "Endpoint",
    "client_asset",
    "client_page",
    "is_welcome",
    "start",
    "stop",
]
