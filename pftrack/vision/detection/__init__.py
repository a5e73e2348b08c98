"""Detection: finding a face, a hand, or corners, in a picture without knowing anything of where they were.

A tracker follows what it has been shown; detection shows it. It is needed on the first picture of a recording and when
a face has been lost for good. Members:

- `cascades`: boxes around faces and eyes;
- `refinement`: irises, nose and mouth near where the mean model puts them;
- `face`: the eleven features of the face to be tracked, or the reason why there is none;
- `corners`: places that can be told from their surroundings;
- `silhouette`: which pixels belong to a hand, and whether they can be one hand;
- `thinning`: the skeleton of a silhouette, and its lines that end freely;
- `protrusions`: what of a silhouette looks like fingers, arm and wrist;
- `open_hand`: the first pose of an open hand, and the shape of this person's;
- `raised_fingers`: which fingers those may be that are seen, where they are fewer than five;
- `hand_guess`, `hand_fit`: how a hand is guessed from its fingers, and fitted to the silhouette.
"""

from pftrack.vision.detection.face import DetectedFace, FaceError, detect, find_again

__all__ = ["DetectedFace", "FaceError", "detect", "find_again"]
