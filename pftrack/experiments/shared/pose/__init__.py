"""Trackers of the pose of a solid by its features, whatever these look like (Bando 2007, ch. 4).

- `methods`: the ways of tracking, and what they report; `layered`: features in two layers with an adapting sampling
  distribution, and two such filters beside each other;
- `state`: the solid, layers or joint particles behind one interface, and the posterior of one frame;
- `calibrated`: a band of the pose that holds the truth; `parameters`: all that can be set;
- `particles`: particles of the whole pose, what poses are worth, and what each point contributes;
- `drawing`: pieces of drawings, and what is measured and plotted of a pose.
"""

__all__: list[str] = []
