"""The tables of document 1, ch. 3: occlusion, sensitivity, the number of particles, and the learned motion."""

__all__: list[str] = []
