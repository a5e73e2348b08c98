"""Trackers of trajectories: many points at once, each by itself, whose measurements now and then are far off.

- `parameters`: what can be turned;
- `corner_parameters`, `corners`: where measurements come from in pictures, by block matching;
- `state`: what is believed of all tracks, and the last frames of each;
- `inspection`: what there is to look into of the selected track;
- `step`: the trackers, and what they report of the selected track and of all together.
"""

__all__: list[str] = []
