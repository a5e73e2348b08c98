"""The figures of Shimada 1997, chapter 2: the pose of a hand from its silhouette.

- `trials`: runs of a motion under several conditions;
- `table`: how often a hand is right, with one hypothesis and with four, by either ranking; what the switches do;
- `steps`: how much of the silhouette a step of an angle changes;
- `figures`: what the page on the experiment shows.
"""

__all__: list[str] = []
