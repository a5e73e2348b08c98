"""Results of trackers in common file formats: boxes of one or several targets, frame by frame.

| form | a file | counts from |
|---|---|---|
| MOTChallenge | text: frame, id, x, y, w, h, score, ... | frames 1, pixels 1 |
| OTB | text: x, y, w, h, a line a frame | pixels 1 |
| VOT | text: x, y, w, h, or four corners, a line a frame; one number where there is no box | pixels 0 |
| CVAT | XML for video: tracks of boxes with left, top, right and bottom edge | 0 |
| COCO | JSON: images and annotations with a track's number; or a list of results; or boxes by video (YouTube-VIS) | 0 |
| CSV | a table whose header names the columns | 0 |

Commas, semicolons, tabs or spaces separate numbers. Internally, frames and pixels count from 0.

- `table`: the content and form of a file; CSV, MOTChallenge, OTB and VOT;
- `writing`: reading and writing the boxes of a file in these forms, and CVAT and COCO;
- `parts`: results, clip and truth as a recording of beliefs.
"""

__all__: list[str] = []
