"""Tracks as a source: in each frame the positions of a body's points and the variances of their noise, and no picture.

- `bodies`: what a body has, and bodies that can be simulated;
- `target`: what is true of a body, and what is known of it beforehand;
- `scene`: a simulated body that turns before a camera.
"""

__all__: list[str] = []
