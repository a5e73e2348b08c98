"""Set membership: what is possible, rather than what is probable (Shimada 1997, chapter 5).

Where noise and motion have hard bounds, the states that fit all that was seen are a set. It is followed as a few
*regions*, each an ellipsoid in a box of guides. Every step keeps every point that fits, so the truth is in one of them
as long as the bounds hold; the price is that the sets are larger than need be.

- `ellipsoids`: what contains a cut and a motion, and what lies in another;
- `regions`: an ellipsoid and its guides, how they bound each other, and one whole frame of a family of them;
- `cells`: which angles of a link fit, the runs that these make, and how they cut a region in the plane;
- `space`: the same in space, and where the image of each link lies.
"""
