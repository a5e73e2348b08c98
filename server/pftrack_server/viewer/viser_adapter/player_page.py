"""viser's client as a player: a page that is told which frame of a recording to show, and needs no server.

The client's own player can only play; to go back it repeats all from the beginning. So it is given a recording without
frames, and the scripts of `player/` hand it the messages that lead from one frame to another. They live in the page as
those of `client/` do.
"""

from pathlib import Path

import viser

from pftrack_server.viewer.modules import join
from pftrack_server.viewer.viser_adapter.client_page import client_scripts, client_style

PLAYER = Path(__file__).parent / "player"
SCRIPTS = ("unpack.js", "camera.js", "nodes.js", "player.js")
FROM_CLIENT = ("frames.js", "colours.js", "state.js", "keys.js")
"""Those of the session's scene that a player needs as well."""
THEME, DARK = "{page theme}", "{page is dark}"
"""Stand in the page for "light" or "dark", and for whether it is dark; whoever shows the page puts these in."""


def player_page(server: viser.ViserServer) -> str:
    """Return the page of a player for what a server's scene shows before its first drawing.

    Args:
        server: Whose lights and directions the player has.
    """
    page = server.get_scene_serializer().as_html()
    page = page.replace("{darkMode:false}", f"{{darkMode:{DARK}}}", 1).replace("<title>Viser</title>", "", 1)
    theme = f'<script>document.documentElement.dataset.theme = "{THEME}";</script>'
    player = f"<script>{join(PLAYER / name for name in SCRIPTS)}</script>"
    style = f"{client_style()}{(PLAYER / 'style.css').read_text(encoding='utf-8')}"
    head, body = page.index("<head>") + len("<head>"), page.index("</head>")
    scripts = f"{theme}{client_scripts(FROM_CLIENT)}{player}"
    return f"{page[:head]}{scripts}{page[head:body]}<style>{style}</style>{page[body:]}"
