"""Pictures and films of pftrack, made by pftrack, so that the documentation shows the real program.

`python -m tools.pictures FOLDER` starts a server on data of its own, opens its pages in Debian's Chromium and saves
pictures of them. Every run has a fixed seed, so that only a change of the program changes a picture. Films are made of
single awaited frames, so they do not depend on the machine's load.

- `server`: a server for as long as it is needed
- `browser`: Chromium, and films of its pages
- `shots`: the pictures and films by name
- `live`: runs as pages of their own
"""
