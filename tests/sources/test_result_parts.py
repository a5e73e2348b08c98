"""Results, their clip and their truth as files that are taken together."""

from pathlib import Path

import numpy as np
import pytest

from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import sniff
from pftrack.sources.limits import HEAD_BYTES
from pftrack.sources.results.parts import part_names
from pftrack.sources.sequence import open_sequence
from pftrack.vision.film import FilmWriter

MOT = b"1,1,10,20,30,40,1,-1,-1,-1\n2,1,11,20,30,40,1,-1,-1,-1\n"
MP4, PNG = b"\x00\x00\x00\x18ftypmp42", b"\x89PNG\r\n\x1a\n"


def test_names_tell_a_truth_from_results() -> None:
    """Contents tell the rest."""
    truth, alone = "gt.txt", "groundtruth_rect.txt"
    three = {"clip": "walk.mp4", "results": "det.txt", "truth": truth}
    assert part_names({"det.txt": MOT, truth: MOT, "walk.mp4": MP4}) == three
    assert part_names({alone: MOT, "walk.mp4": MP4}) == {"clip": "walk.mp4", "results": alone}
    assert part_names({"a.png": PNG, "b.png": PNG, "gt.txt": MOT}) is None
    assert part_names({"a.mp4": MP4, "b.mp4": MP4}) is None


@pytest.mark.parametrize("line", [b"%d,1,10.25,20,30,40,0.9,-1,-1,-1", b"1%d,20,30,40", b"%d.5\t20\t30\t40"])
def test_a_long_file_is_known_by_its_beginning(line: bytes) -> None:
    """Wherever that is cut, as within a line."""
    whole = b"\n".join(line % number for number in range(1, 200))
    for more in range(20):
        assert sniff((b"\n" * more + whole)[:HEAD_BYTES]).kind == "beliefs"


@pytest.mark.parametrize(
    ("heads", "words"),
    [
        ({"a.mp4": MP4, "b.mp4": MP4, "det.txt": MOT}, r"of one clip, got a\.mp4 and b\.mp4"),
        ({"a.txt": MOT, "b.txt": MOT}, r"call the truth gt\.txt"),
        ({"walk.mp4": MP4, "det.txt": MOT, "sound.mp3": b"ID3"}, r"sound\.mp3 does not go with results"),
        ({"det.txt": MOT, "truth.pft": b"PK\x03\x04" + bytes(26) + b"recording.json"}, "expected a truth of boxes"),
    ],
)
def test_what_does_not_go_together_is_refused(heads: dict[str, bytes], words: str) -> None:
    """In a sentence that names the files."""
    with pytest.raises(RefusedError, match=words):
        part_names(heads)


def test_a_folder_holds_them(tmp_path: Path) -> None:
    """It is one recording of beliefs, with the pictures of the clip; an index of it is taken again."""
    with FilmWriter(tmp_path / "walk.mp4", 25.0) as film:
        for t in range(2):
            film.write(np.full((96, 128, 3), 90 * t, dtype=np.uint8))
    (tmp_path / "det.txt").write_bytes(MOT)
    (tmp_path / "gt.txt").write_bytes(MOT.replace(b"20,", b"21,"))
    sequence = open_sequence(tmp_path)
    assert (sequence.index.kind, sequence.size, sequence.frame_count) == ("beliefs", (128, 96), 2)
    assert sequence.picture(1).mean() == pytest.approx(90, abs=2)
    assert sequence.index.warnings[-2:] == (
        "The truth that came along is of 1 target in 2 frames.",
        "Of the truth: Its first frame was taken as 1.",
    )
    assert open_sequence(tmp_path, index=sequence.index).index == sequence.index
    (tmp_path / "gt.txt").write_bytes(MOT)
    assert open_sequence(tmp_path).sha256 != sequence.sha256
