"""A run as one page that needs no server: the 3-D scene, a scrubber, plots and figures in a file that is opened.

The page holds viser's client in a frame, and a recording of what the live scene would have shown. Frames are not
messages in a row, as in viser's own recordings, but states (`viser_adapter.recorder`), so that each is as near as any
other. One clock in the page says which frame it is; scene, plots and figures follow it.

- `recording`: a run's frames through the live scene
- `packing`, `lines`, `pictures`: what becomes of them, so that 300 frames of a recording stay under 10 MB
- `document`, `plots`: the page put together, with the plots that the library prints
- `page/`: what is in it; the player in its frame is viser's (`viser_adapter.player_page`)

`pftrack` finds `write_page` by its entry point, when somebody asks for it (`pftrack.output.exports.formats`).
"""

from pftrack_server.viewer.standalone.document import write_page

__all__ = ["write_page"]
