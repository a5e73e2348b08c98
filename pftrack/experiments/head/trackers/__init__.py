"""Trackers of a head by templates of its features (Bando 2007, ch. 4 section 4).

- `step`: the trackers by name; `parameters`: all that can be set
- `first_sight`: the solid and the templates that are made from frame 0; `starting_face`: a face model brought along
- `memory`: templates and size of the face; `templates`: how large they are cut; `reliefs`: how they are laid onto it
- `growth`: the person's own face, found while it is tracked; `reports`: what is told of a frame
"""

__all__: list[str] = []
