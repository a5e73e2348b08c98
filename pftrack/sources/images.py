"""Folders of pictures: each file is a frame, in natural order of their names (`2.png` before `10.png`); animations.

Pillow reads them. It reads a picture's size from its header before it decodes, can be limited to one format, and
handles palettes, transparency and the camera's orientation. All pictures are converted to 8-bit RGB:

- 16-bit grey keeps its upper byte, as 16-bit colour does in Pillow: full scale stays full scale;
- transparent parts lie on white paper, as those of a GIF do in FFmpeg;
- a photograph is turned upright by its orientation tag.

Pillow also composes the partial frames of an animated PNG or WebP, and reads their durations. Animated GIFs are read by
`pftrack.sources.video`.
"""

import hashlib
import io
import re
import threading
import weakref
import zlib
from abc import abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps
from typing_extensions import override

from pftrack.core.model.source import FrameIndex, FrameSequence
from pftrack.core.refusal import RefusedError
from pftrack.sources.formats import Format, sniff
from pftrack.sources.limits import HEAD_BYTES, Limits, check_bytes, check_pixels, natural_order
from pftrack.sources.sequence import BoundedCache

_PICTURES = "PNG, JPEG, BMP, TIFF or WebP pictures"
_RATE_HZ = 25.0
_STEADY = 0.25
"""Largest difference of two gaps between frames at a steady rate, as a share."""
_DEEP_GREY = {"I;16", "I;16L", "I;16B", "I;16N"}
_DEPTHLESS = {"I", "F"}
NUMBER = re.compile(r"[0-9]{1,15}(?=[^0-9]*$)")
_PLUG_INS = {"PNG", "JPEG", "BMP", "TIFF", "WEBP"}
_ALBUMS = {"TIFF", "PNG", "WEBP"}  # a JPEG may carry its own preview as a second picture


def unsteady(times_s: NDArray[np.float64], tick_s: float) -> list[str]:
    """Return a warning if times, s and exact to a tick, are not evenly spaced; nothing otherwise."""
    gaps = np.diff(times_s)
    if gaps.size == 0 or np.ptp(gaps) <= _STEADY * np.median(gaps) + 2 * tick_s:
        return []
    steps = gaps / np.median(gaps)
    if steps.min() > 0.5 and (np.abs(steps - np.round(steps)) <= _STEADY / 2 + tick_s / np.median(gaps)).all():
        lost, place = round(float((steps - 1).sum())), int(np.argmax(steps > 1 + _STEADY))
        many = "1 frame is" if lost == 1 else f"{lost} frames are"
        return [f"{many} missing by the times, first after frame {place}; numbers count those that are there"]
    slowest, fastest = 1 / gaps.max(), 1 / gaps.min()
    return [f"the frame rate varies between {slowest:.3g} and {fastest:.3g} Hz; frames play at the mean rate"]


class _Pictures(FrameSequence):
    """Pictures that Pillow reads, each checked against its checksum; used from several threads, one at a time."""

    def __init__(self, name: str, limits: Limits) -> None:
        self.name = name
        self._limits = limits
        self._lock = threading.Lock()
        self._cache: BoundedCache[NDArray[np.uint8]] = BoundedCache(limits.cache_bytes)

    @abstractmethod
    def _read(self, index: int) -> NDArray[np.uint8]:
        """Decode a picture (height, width, 3)."""

    @override
    def _picture(self, index: int) -> NDArray[np.uint8]:
        with self._lock:
            picture = self._cache.get(index)
            if picture is None:
                picture = self._read(index)
                if zlib.crc32(picture.data) != self.index.checksums[index]:
                    raise RefusedError(f"picture {index} has changed; what is open must not change")
                self._cache.put(index, picture, picture.nbytes)
            return picture

    @override
    def close(self) -> None:
        with self._lock:
            self._cache.clear()


class ImageSequence(_Pictures):
    """The pictures of a folder."""

    def __init__(self, folder: Path, limits: Limits, index: FrameIndex | None) -> None:
        """List the pictures and survey them, unless their index is known already.

        Args:
            folder: Their folder; folders in it, hidden files and files that are not pictures are skipped.
            limits: Its limits.
            index: From an earlier survey of the same content.

        Raises:
            RefusedError: There are none, one is broken, they differ in size or exceed the limits.
        """
        super().__init__(folder.resolve().name, limits)
        self._files, left_out = _list(folder, limits)
        sha256 = hashlib.sha256(b"".join(file.digest for file in self._files)).hexdigest()
        known = index is not None and (index.sha256, index.kind) == (sha256, "images")
        self.index = index if known and index is not None else self._survey(sha256, left_out)

    @override
    def _read(self, index: int) -> NDArray[np.uint8]:
        return _decode(self._files[index], self._limits)

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


class AnimationSequence(_Pictures):
    """The pictures of an animated PNG or WebP."""

    def __init__(
        self, file: BinaryIO, found: Format, *, name: str, sha256: str, limits: Limits, index: FrameIndex | None
    ) -> None:
        """Survey the file, unless its index is known already.

        Args:
            file: Open for reading; closed with the sequence.
            found: What its content is.
            name: What people call it.
            sha256: Digest of its content.
            limits: How large it may be.
            index: From an earlier survey of the same content.

        Raises:
            RefusedError: It holds one picture, is broken, or exceeds the limits.
        """
        super().__init__(name, limits)
        self._file, self._format = file, found
        with _readable(f"the {found.title}", limits):
            self._begin()
            check_pixels(self._image.width, self._image.height, limits, "the pictures of the animation have")
            # What programs show that know no animation need not be part of it.
            self._first = int(getattr(self._image, "default_image", False))
            count = getattr(self._image, "n_frames", 1) - self._first
        if count > limits.frames:
            raise RefusedError(f"the animation has {count:,} frames; at most {limits.frames:,} are allowed")
        if count + self._first < 2:
            raise RefusedError(f"the {found.title} holds one picture; expected a sequence")
        self.index = index if index is not None else self._survey(sha256, count)
        self._close_file = weakref.finalize(self, file.close)  # also when nobody remembers to

    @override
    def close(self) -> None:
        super().close()
        self._close_file()

    @override
    def _read(self, index: int) -> NDArray[np.uint8]:
        with _readable(f"the {self._format.title}", self._limits):
            if self._first + index < self._image.tell():  # Pillow loses count on its way back
                self._begin()
            self._image.seek(self._first + index)
            return _rgb(self._image)

    def _begin(self) -> None:
        self._image: Any = Image.open(self._file, formats=[self._format.decoder])  # its plug-ins have more than it

    def _survey(self, sha256: str, count: int) -> FrameIndex:
        """Decode everything once."""
        checksums, lasting_s = list[int](), list[float]()
        for number in range(count):
            picture = self._read(number)
            checksums.append(zlib.crc32(picture.data))
            lasting_s.append(float(self._image.info.get("duration", 0)) / 1000)
        times_s = np.cumsum([0.0, *lasting_s[:-1]])
        rate_hz, warnings = count / (sum(lasting_s) or np.inf), unsteady(times_s, 0.001)
        if min(lasting_s) <= 0:
            rate_hz, times_s = _RATE_HZ, np.arange(count) / _RATE_HZ
            warnings = [f"frames are said to last no time; {rate_hz:g} Hz are taken instead"]
        return FrameIndex(
            kind="gif",
            sha256=sha256,
            width=picture.shape[1],
            height=picture.shape[0],
            frame_rate_hz=rate_hz,
            times_s=tuple(times_s.tolist()),
            checksums=tuple(checksums),
            warnings=tuple(warnings),
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
            if found.decoder in _PLUG_INS:
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
    content = io.BytesIO(file.path.read_bytes())
    with _readable(file.title, limits), Image.open(content, formats=[file.format]) as image:
        _check(image, file, limits)
        return _rgb(image)


@contextmanager
def _readable(title: str, limits: Limits) -> Iterator[None]:
    """Refuse, by its title, a picture that Pillow cannot read.

    Raises:
        RefusedError: It is too large, broken or cut short, or was refused already.
    """
    try:
        yield
    except (RefusedError, MemoryError):
        raise
    except (Image.DecompressionBombError, Image.DecompressionBombWarning):
        raise RefusedError(f"{title} is too large; at most {limits.pixels:,} pixels are allowed") from None
    except Exception:  # noqa: BLE001 - whatever a decoder makes of broken bytes, it is the bytes that are broken
        raise RefusedError(f"{title} is broken or cut short; expected {_PICTURES} that open elsewhere") from None


def _check(image: Image.Image, file: _File, limits: Limits) -> None:
    """Refuse, by its header, a picture that is too large or has no unique display."""
    check_pixels(image.width, image.height, limits, f"{file.title} has")
    if image.mode in _DEPTHLESS:
        raise RefusedError(f"{file.title} has 32 bits a channel; expected 8 or 16")
    pages = getattr(image, "n_frames", 1) if file.format in _ALBUMS else 1
    if pages > 1:
        raise RefusedError(f"{file.title} holds {pages} pictures; expected one a file")


def _rgb(image: Image.Image) -> NDArray[np.uint8]:
    """Return a picture as 8-bit RGB, upright and on white paper, read-only."""
    deep = image.mode in _DEEP_GREY
    image = ImageOps.exif_transpose(image)
    if deep:
        grey = (np.asarray(image).astype(np.uint16) >> 8).astype(np.uint8)
        picture = np.repeat(grey[:, :, np.newaxis], 3, axis=2)
    else:
        picture = np.array(on_paper(image) if image.has_transparency_data else image.convert("RGB"))
    picture.setflags(write=False)
    return picture


def on_paper(image: Image.Image) -> Image.Image:
    """Return a picture whose transparent parts lie on white paper."""
    paper = Image.new("RGBA", image.size, "white")
    return Image.alpha_composite(paper, image.convert("RGBA")).convert("RGB")
