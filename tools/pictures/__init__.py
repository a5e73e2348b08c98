"""Pictures and films of pftrack, made by pftrack: what the documentation shows is what the program does.

`python -m tools.pictures FOLDER` starts a server on data of its own, opens its pages in Debian's Chromium and saves
what is seen. Every run has a fixed seed, so that only a change of the program changes a picture. Films are made of
single frames, each awaited, and not of what a busy machine happens to show.

- `server`: a server for as long as it is needed
- `browser`: Chromium, and films of its pages
- `shots`: the pictures and films by name
- `live`: runs as pages of their own
"""
