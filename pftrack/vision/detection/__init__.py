"""Detection: finding a face, corners or pieces of a picture without knowing anything of where they were.

A tracker follows what it has been shown; detection shows it. It is needed on the first picture of a recording and when
a face has been lost for good.

- `face`: the eleven features of the face to be tracked, or the reason why there is none;
- `corners`: places that can be told from their surroundings;
- `matching`: where small pieces of an earlier picture are in a later one.
"""

from pftrack.vision.detection.face import DetectedFace, FaceError, detect, find_again

__all__ = ["DetectedFace", "FaceError", "detect", "find_again"]
