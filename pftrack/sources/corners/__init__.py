"""A simulated sequence whose corners are easily mistaken for each other (Ichimura and Ikoma 2000, section 5.2).

Their own sequence is not public. This one has its difficulties: a wall with a lattice, whose crossings are
alike; a book with a slanted line, along which nothing tells one point from the next; a box without such traps; and
light that jumps. Everything moves by parts of pixels, and in every frame it is known where each corner truly is.

- `textures`: what is painted on wall, book and box;
- `motion`: where they are in each frame, and with them any point of the picture;
- `scene`: the frames, and the corners to be followed.
"""

__all__: list[str] = []
