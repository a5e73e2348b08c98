"""Sources: random access to frames, from a camera's recording or from a simulated scene.

A source answers `frame(index, history)`: what is to be seen at that instant, given what the scene's parameters were up
to then. Simulated scenes know the truth and change their look with live parameters; a recording can wear the same
overlay of an occluder and look-alikes. The members:

- `signal`: the one-dimensional signals of Bando 2007, ch. 2;
- `ball`: the simulated ball behind an occluder, among distracters;
- `prism`: the vertices of a turning prism, measured in noise;
- `fish`: one or two goldfish in a tank from above, which bend as they turn;
- `linkage`: a chain of three links, whose joints are measured by an orthographic camera;
- `head`: a simulated driver's head in near-infrared light, and what passes in front of it;
- `recording`: a video, a folder of pictures or an animation (`sequence`, `video`, `images`), with an overlay;
- `overlay`: the strip and the look-alikes themselves.
"""
