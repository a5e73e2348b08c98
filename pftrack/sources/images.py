"""Folders of pictures: each file is a frame, in natural order of their names (`2.png` before `10.png`).

Pillow reads them. It reads a picture's size from its header before it decodes, can be limited to one format, and
handles palettes, transparency and the camera's orientation. All pictures are converted to 8-bit RGB:

- 16-bit grey keeps its upper byte, as 16-bit colour does in Pillow: full scale stays full scale;
- transparent parts lie on white paper, as those of a GIF do in FFmpeg;
- a photograph is turned upright by its orientation tag.

Animated GIFs are read by `pftrack.sources.video`: FFmpeg composes their partial frames correctly and reads their times.
"""

import hashlib
import io
import re
import threading
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps
from typing_extensions import override

from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, check_bytes, check_pixels, natural_order
from pftrack.sources.sequence import BoundedCache

_PICTURES = "PNG, JPEG, BMP, TIFF or WebP pictures"
_RATE_HZ = 25.0
_DEEP_GREY = {"I;16", "I;16L", "I;16B", "I;16N"}
_DEPTHLESS = {"I", "F"}
NUMBER = re.compile(r"[0-9]{1,15}(?=[^0-9]*$)")
_ALBUMS = {"TIFF", "PNG", "WEBP"}  # a JPEG may carry its own preview as a second picture


class ImageSequence(FrameSequence):
    """The pictures of a folder; may be used from several threads, one at a time."""

    def __init__(self, folder: Path, limits: Limits, index: FrameIndex | None) -> None:
        """List the pictures and survey them, unless their index is known already.

        Args:
            folder: Their folder; folders in it, hidden files and files that are not pictures are skipped.
            limits: Its limits.
            index: From an earlier survey of the same content.

        Raises:
            RefusedError: There are none, one is broken, they differ in size or exceed the limits.
        """
        self.name = folder.resolve().name
        self._limits = limits
        self._lock = threading.Lock()
        self._cache: BoundedCache[NDArray[np.uint8]] = BoundedCache(limits.cache_bytes)
        self._files, left_out = _list(folder, limits)
        sha256 = hashlib.sha256(b"".join(file.digest for file in self._files)).hexdigest()
        known = index is not None and (index.sha256, index.kind) == (sha256, "images")
        self.index = index if known and index is not None else self._survey(sha256, left_out)

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        with self._lock:
            picture = self._cache.get(index)
            if picture is None:
                picture = _decode(self._files[index], self._limits)
                if zlib.crc32(picture.data) != self.index.checksums[index]:
                    raise RefusedError(f"picture {index} has changed; a folder must not change while it is open")
                self._cache.put(index, picture, picture.nbytes)
            return picture

    @override
    def close(self) -> None:
        with self._lock:
            self._cache.clear()

    def _survey(self, sha256: str, left_out: int) -> FrameIndex:
        """Decode everything once."""
        checksums: list[int] = []
        shape: tuple[int, ...] = ()
        for number, file in enumerate(self._files):
            picture = _decode(file, self._limits)
            shape = shape or picture.shape
            if picture.shape != shape:
                raise RefusedError(
                    f"{file.title} is {picture.shape[1]} x {picture.shape[0]} px and {self._files[0].title} is "
                    f"{shape[1]} x {shape[0]} px; all pictures must be of one size"
                )
            checksums.append(zlib.crc32(picture.data))
            if self._cache.used_bytes < self._limits.cache_bytes // 2:
                self._cache.put(number, picture, picture.nbytes)
        told = missing_numbers([file.path.stem for file in self._files])
        others = "1 file that is not a picture is" if left_out == 1 else f"{left_out} files that are not pictures are"
        return FrameIndex(
            kind="images",
            sha256=sha256,
            width=shape[1],
            height=shape[0],
            frame_rate_hz=_RATE_HZ,
            times_s=tuple(number / _RATE_HZ for number in range(len(checksums))),
            checksums=tuple(checksums),
            warnings=(*told, *([f"{others} passed over"] if left_out else [])),
        )


@dataclass(frozen=True, slots=True)
class _File:
    """One picture of a folder: its path, format, and the digest of its bytes."""

    path: Path
    format: str
    digest: bytes

    @property
    def title(self) -> str:
        """Its name in messages: the file's own name."""
        name = "".join(letter if letter.isprintable() else "?" for letter in self.path.name)
        return name if len(name) <= 60 else f"{name[:57]}..."


def _list(folder: Path, limits: Limits) -> tuple[list[_File], int]:
    """Find the pictures in order, and count the files passed over."""
    paths = [path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")]
    if len(paths) > limits.frames:
        raise RefusedError(f"the folder has {len(paths):,} files; at most {limits.frames:,} are allowed")
    check_bytes(sum(path.stat().st_size for path in paths), limits, "the folder's files have")
    files = []
    for path in sorted(paths, key=lambda path: natural_order(path.name)):
        with path.open("rb") as file:
            try:
                found = sniff(file.read(HEAD_BYTES))
            except RefusedError:
                continue
            if found.kind == "picture":
                file.seek(0)
                files.append(_File(path, found.decoder, hashlib.file_digest(file, "sha256").digest()))
    if not files:
        what = "is empty" if not paths else "holds no pictures"
        raise RefusedError(f"the folder {what}; expected {_PICTURES}")
    return files, len(paths) - len(files)


def missing_numbers(stems: Sequence[str]) -> tuple[str, ...]:
    """Return a warning if the numbers in the names of pictures, in order, have gaps; nothing otherwise."""
    found = [NUMBER.search(stem) for stem in stems]
    numbers = [int(one[0]) for one in found if one is not None]
    steps = np.diff(numbers)
    if len(numbers) < len(stems) or len(steps) == 0 or steps.min() <= 0 or steps.max() == steps.min():
        return ()
    step = int(steps.min())
    gaps = [place for place, one in enumerate(steps) if one > step]
    first = gaps[0]
    last, following = stems[first], stems[first + 1]
    more = f", and there are {len(gaps) - 1} more gaps" if len(gaps) > 1 else ""
    told = f"pictures are missing between {last} and {following}{more}; frame {first + 1} is {following}"
    return (told,)


def _decode(file: _File, limits: Limits) -> NDArray[np.uint8]:
    """Read a picture as 8-bit RGB, read-only."""
    try:
        with Image.open(io.BytesIO(file.path.read_bytes()), formats=[file.format]) as image:
            _check(image, file, limits)
            picture = np.ascontiguousarray(_rgb(image))
    except (RefusedError, MemoryError):
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise RefusedError(f"{file.title} is too large; at most {limits.pixels:,} pixels are allowed") from None
    except Exception:  # noqa: BLE001 - whatever a decoder makes of broken bytes, it is the bytes that are broken
        raise RefusedError(f"{file.title} is broken or cut short; expected {_PICTURES} that open elsewhere") from None
    picture.setflags(write=False)
    return picture


def _check(image: Image.Image, file: _File, limits: Limits) -> None:
    """Refuse, by its header, a picture that is too large or has no unique display."""
    check_pixels(image.width, image.height, limits, f"{file.title} has")
    if image.mode in _DEPTHLESS:
        raise RefusedError(f"{file.title} has 32 bits a channel; expected 8 or 16")
    pages = getattr(image, "n_frames", 1) if file.format in _ALBUMS else 1
    if pages > 1:
        raise RefusedError(f"{file.title} holds {pages} pictures; expected one a file")


def _rgb(image: Image.Image) -> NDArray[np.uint8]:
    deep = image.mode in _DEEP_GREY
    image = ImageOps.exif_transpose(image)
    if deep:
        grey = (np.asarray(image).astype(np.uint16) >> 8).astype(np.uint8)
        return np.repeat(grey[:, :, np.newaxis], 3, axis=2)
    return np.asarray(on_paper(image) if image.has_transparency_data else image.convert("RGB"))


def on_paper(image: Image.Image) -> Image.Image:
    """Return a picture whose transparent parts lie on white paper."""
    paper = Image.new("RGBA", image.size, "white")
    return Image.alpha_composite(paper, image.convert("RGBA")).convert("RGB")
