"""Results of trackers in the forms that others write and read: boxes of one or several targets, frame by frame.

| form | a file | counts from |
|---|---|---|
| MOTChallenge | text: frame, id, x, y, w, h, score, ... | frames 1, pixels 1 |
| OTB | text: x, y, w, h, a line a frame | pixels 1 |
| VOT | text: x, y, w, h, or four corners, a line a frame; one number where there is no box | pixels 0 |
| CVAT | XML for video: tracks of boxes with left, top, right and bottom edge | 0 |
| COCO | JSON: images and annotations with a track's number; or a list of results; or boxes by video (YouTube-VIS) | 0 |
| CSV | a table whose header names the columns | 0 |

Numbers are told apart by commas, semicolons, tabs or spaces. Inside, frames and pixels count from 0.

- `table`: what a file says, which form it has, CSV, MOTChallenge, OTB and VOT;
- `writing`: the boxes of a file, the same forms back, and CVAT and COCO;
- `parts`: results with their clip and their truth as a recording of beliefs.
"""

__all__: list[str] = []
