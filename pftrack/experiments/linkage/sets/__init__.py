"""Set membership: what is possible, rather than what is probable (Shimada 1997, chapter 5).

Where noise and motion have hard bounds, the states that fit all that was seen are a set. It is followed as a few
*regions*, each an ellipsoid in a box of guides. Every step keeps every point that fits, so the truth is in one of them
as long as the bounds hold; the price is that the sets are larger than need be.

- `regions`: a region, its guides, its prediction, and how a link in the plane cuts it;
- `plane`: strips and cells of a link's direction in the plane; polygons of the picture;
- `space`: cells of attitude and direction in space, and how they cut a region;
- `merging`: whether a region lies in another, and one whole frame of a family of regions.
"""
