"""A chain of three links before one camera: what Kalman filters and regions make of it (Shimada 1997).

- `trials`: runs of the experiment, and of motions that its scene has not;
- `kalman`: Kalman filters that are cut by bounds and follow mirror images, chapter 4; links seen as lines; the figures;
- `regions`: ellipsoids and guides that never exclude the truth, chapter 5, and their algebra on random cases.
"""

__all__: list[str] = []
