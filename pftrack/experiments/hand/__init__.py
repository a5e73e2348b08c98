"""The experiment on a hand whose pose comes from its silhouette.

- `experiment`: the wiring; `presets`: where to begin; `findings`: what there is to say of a silhouette;
- `sketch`: what is drawn in the picture; `world`, `solids`: the hand in space beside it;
- `calibration`: where what is said of its error is not so;
- `truth`: how near to the truth each kept hand is, of one frame and of a whole run;
- `recording`, `marks`: recordings, and the open hand that is found on them or marked.
"""
