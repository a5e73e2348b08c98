"""Detection: finding a face in a picture without knowing anything of where it was.

A tracker follows what it has been shown; detection shows it. It is needed on the first picture of a recording and when
a face has been lost for good. Members:

- `cascades`: boxes around faces and eyes;
- `refinement`: irises, nose and mouth near where the mean model puts them;
- `face`: the eleven features of the face to be tracked, or the reason why there is none.
"""

from pftrack.detection.face import DetectedFace, FaceError, detect, find_again

__all__ = ["DetectedFace", "FaceError", "detect", "find_again"]
