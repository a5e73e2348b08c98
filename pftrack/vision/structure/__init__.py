"""Structure: the shape of a rigid body from the positions of its points in many views (Bando 2007, ch. 4 section 5).

A camera that is far away maps a body linearly, so the positions of its points over all frames are a product of two
factors: motion, two rows per frame, and shape, three numbers per point. The members, the simplest first:

- `factorization`: the input (positions and the variances of their noise, infinite where a point was not seen); the
  error of a reconstruction; the factors by singular values, and the map that turns them into cameras;
- `variational`: the factors by variational Bayes, each position weighed by its own noise; for all frames at once, or
  frame by frame over a sliding window with forgetting;
- `recursive`: this project's own method, frame by frame: the joint covariance of all points with each frame's pinhole
  integrated out, from a prior or from the first frames;
- `growing`: from the mean of other bodies to the body's own shape, as far as that predicts better; and undetected wrong
  measurements.

A view's camera is in `cameras`.
"""
