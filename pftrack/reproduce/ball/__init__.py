"""The tables of Bando 2007, ch. 3: occlusion, sensitivity, the number of particles, and the learned motion."""

__all__: list[str] = []
