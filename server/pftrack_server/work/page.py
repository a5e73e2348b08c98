"""A run as one page that needs no server: a session's page that plays recorded messages of its stream.

The file holds the `hello` of the session's stream, its drawings (`sessions.worker.codec`), one after the other and
compressed by gzip, and the scripts of the pages that show them (`frontend_static/session/recorded`). Each drawing can
be read alone, so that any frame can be shown directly: the page adds the pictures that a drawing names.

`pftrack` finds `write_page` by its entry point when it is needed (`pftrack.output.exports.formats`).
"""

import base64
import gzip
import json
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from pydantic_core import to_json

from pftrack.core.model.drawing import Drawing, Points
from pftrack.core.model.glossary import GLOSSARY
from pftrack.core.model.parameters import flat
from pftrack.core.version import __version__
from pftrack.experiments.shared.sketch import with_depth
from pftrack.output.displays import explanation_html, summary_lines
from pftrack.runs.loss import Loss
from pftrack.runs.loss_probability import LossAccount
from pftrack.runs.manifest import citation_of, manifest_of, title_of
from pftrack.runs.run import Run
from pftrack_server.core.frontend import FRONTEND, IMPORT, beside, modules_of
from pftrack_server.core.pictures import EncodedPicture
from pftrack_server.sessions.spec import FIRST, BranchSpec, Phase, RunSnapshot, SessionSpec
from pftrack_server.sessions.state import SessionState
from pftrack_server.sessions.stream import Hello
from pftrack_server.sessions.worker.codec import DrawingEncoder, picture_record
from pftrack_server.sessions.worker.description import FrameView, describe, describe_timeline, with_loss
from pftrack_server.sessions.worker.protocol import Ready

MOST_BYTES = 6_500_000
"""Most bytes of the drawings of 300 frames; as text in the page they are a third larger, and its scripts add 0.6 MB."""
USUAL_FRAMES = 300
LEAST_SHARE = 0.3
"""Least share of those bytes, for a short run."""
MOST_FRAMES = 1500
"""Most drawn frames; of a longer run every second frame is drawn, or every third, and so on."""
MOST_POINTS = 1500
"""Most drawn points; of a larger cloud every second point is drawn, or every third, and so on."""
BITS = 14
"""Fraction bits of a drawing's numbers: a 16th of a pixel in a picture of 1,000 px."""
FORMS = ((960, 80), (960, 70), (800, 65), (720, 55), (640, 50), (560, 45), (480, 40), (400, 35), (320, 30))
"""Longest side of a picture, px, and quality, from fine to coarse."""
SAMPLE = 12
"""Number of pictures from which the size of all is estimated."""
SCRIPT = "session/recorded.js"
TEMPLATE = Path(__file__).with_name("page.html")
STYLES = (
    "shared/palette.css",
    "shared/style.css",
    "shared/figure/figure.css",
    "session/session.css",
    "session/recorded.css",
)
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data: blob:; "
    "base-uri 'none'; form-action 'none'"
)
"""Content policy: nothing is loaded from any server."""


@dataclass(frozen=True, slots=True)
class Drawings:
    """The drawings of a page.

    Attributes:
        packed: Drawings and pictures, compressed by gzip.
        parts: For each drawing, its first byte and end in the uncompressed data, and those of its pictures.
        every: One of this many frames is drawn.
        thinned: One of this many points of the largest cloud is drawn.
    """

    packed: bytes
    parts: list[list[tuple[int, int]]]
    every: int
    thinned: int


def write_page(run: Run, path: Path) -> Iterator[tuple[int, int]]:
    """Write the computed frames of a run as one HTML page that needs no server and no network.

    Args:
        run: The run; it is moved to each of its frames.
        path: The file to write.

    Yields:
        (frames done, all frames).

    Raises:
        OSError: The file cannot be written.
    """
    share = max(LEAST_SHARE, (run.computed + 1) / USUAL_FRAMES)
    drawings = yield from draw(run, int(share * MOST_BYTES))
    path.write_text(document(run, drawings), encoding="utf-8")


def draw(run: Run, most_bytes: int) -> Generator[tuple[int, int], None, Drawings]:
    """Draw the computed frames of a run.

    Args:
        run: The run; it is moved to each of its computed frames.
        most_bytes: Most bytes of the drawings. Pictures get the bytes left by the rest; if those are too few, only
            every second frame is drawn, and so on.

    Yields:
        (frames done, all frames).
    """
    view, encoder, frames = FrameView(), DrawingEncoder(bits=BITS), run.computed + 1
    every, thinned = -(-frames // MOST_FRAMES), 1
    messages: list[bytes] = []
    named: list[list[int]] = []
    pictures: dict[int, EncodedPicture] = {}
    for frame in range(0, frames, every):
        run.seek(frame)
        drawing, ratio = _thin(view.draw(run, None))
        thinned = max(thinned, ratio)
        encoded = encoder.encode(with_depth(drawing, run.experiment.display.layers), frame)
        pictures |= {picture.key: picture for picture in encoded.pictures}
        messages.append(encoded.message(known=pictures))
        named.append([picture.key for picture in encoded.pictures])
        yield frame + 1, frames
    while True:
        pictures = {key: pictures[key] for keys in named for key in keys}
        left = most_bytes - _size(messages)
        files = shrink([picture.file for picture in pictures.values()], left)
        if sum(map(len, files)) <= left or len(messages) == 1:
            break
        every, messages, named = 2 * every, messages[::2], named[::2]
    known = zip(pictures.values(), files, strict=True)
    records = [picture_record(replace(picture, file=file)) for picture, file in known]
    spans = _spans([*messages, *records])
    places = dict(zip(pictures, spans[len(messages) :], strict=True))
    parts = [[span, *(places[key] for key in keys)] for span, keys in zip(spans, named, strict=False)]
    return Drawings(gzip.compress(b"".join([*messages, *records]), 6, mtime=0), parts, every, thinned)


def _size(messages: Sequence[bytes]) -> int:
    """Return the compressed size of messages, bytes."""
    return len(gzip.compress(b"".join(messages), 6))


def _spans(parts: Sequence[bytes]) -> list[tuple[int, int]]:
    """Return first byte and end of each part."""
    ends = np.cumsum([0, *map(len, parts)]).tolist()
    return list(pairwise(ends))


def _thin(drawing: Drawing) -> tuple[Drawing, int]:
    """Return a drawing with thinned clouds, and the factor by which the largest one was thinned."""
    clouds = {name: item for name, item in drawing.primitives.items() if isinstance(item, Points)}
    every = {name: max(1, -(-len(item.positions) // MOST_POINTS)) for name, item in clouds.items()}
    thin = {
        name: replace(item, positions=item.positions[:: every[name]], colours=item.colours[:: every[name]])
        for name, item in clouds.items()
    }
    return replace(drawing, primitives={**drawing.primitives, **thin}), max(every.values(), default=1)


def shrink(pictures: Sequence[bytes], most_bytes: int) -> list[bytes]:
    """Return pictures shrunk to a total size, or as small as possible.

    Args:
        pictures: JPEG files.
        most_bytes: Most bytes of all together.
    """
    made = list(pictures)
    sample = pictures[:: max(1, len(pictures) // SAMPLE)]
    for form in FORMS:
        if sum(map(len, made)) <= most_bytes:
            break
        likely = sum(len(_encode(file, *form)) for file in sample) / len(sample) * len(pictures)
        if likely <= most_bytes or form == FORMS[-1]:
            made = [_encode(file, *form) for file in pictures]
    return made


def _encode(file: bytes, side: int, quality: int) -> bytes:
    image = cv2.imdecode(np.frombuffer(file, np.uint8), cv2.IMREAD_COLOR)
    if image is None:
        raise ValueError("a picture of a recording is not a JPEG file")
    scale = min(1.0, side / max(image.shape[:2]))
    image = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    options = (cv2.IMWRITE_JPEG_QUALITY, quality, cv2.IMWRITE_JPEG_OPTIMIZE, 1)
    return cv2.imencode(".jpg", image, options)[1].tobytes()


def document(run: Run, drawings: Drawings) -> str:
    """Return the HTML page of a run and its drawings."""
    rows = run.diagnostics
    recording = {
        "parts": drawings.parts,
        "every": drawings.every,
        "before_loss": Loss.of(rows).approach([row.hidden is True for row in rows], 0),
        "glossary": [*GLOSSARY, run.experiment.glossary],
    }
    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(TEMPLATE.read_text("utf-8"))
    return template.render(
        policy=POLICY,
        version=__version__,
        title=title_of(run),
        question=run.experiment.texts.question,
        style=_safe("".join((FRONTEND / name).read_text("utf-8") for name in STYLES)),
        scripts=_data({"imports": {name: _script(name) for name in modules_of(SCRIPT)}}),
        start=SCRIPT,
        drawings=drawings,
        summary=summary_lines(run),
        explanation=_safe(explanation_html(run.explained)) if run.explained else "",
        citation=citation_of(run),
        recipe=json.dumps(run.recipe.with_footage(path=None).as_dict(), indent=2, ensure_ascii=False),
        manifest=_data(manifest_of(run)),
        hello=_data(_hello(run)),
        recording=_data(recording),
        packed=base64.b64encode(drawings.packed).decode(),
    )


def _hello(run: Run) -> Hello:
    """Return the first message of a session's stream at the beginning of this run."""
    at_beginning = RunSnapshot(
        **{**describe_timeline(run), "recipe": run.recipe.with_footage(path=None, truth=None)},
        tracker=run.tracker,
        parameters=flat(run.parameters_at(0)),
        computed=run.computed,
        measured=dict(run.measures()),
    )
    rows = with_loss([row.as_dict() for row in run.diagnostics], LossAccount().follow(run))
    described = describe(run).model_copy(update={"frames": run.computed + 1})
    spec = SessionSpec(id="", branches={FIRST: BranchSpec(title="Main", run=at_beginning)})
    state = SessionState(spec, lambda: None, lambda: None)
    state.enter(Phase.STARTING)
    state.begin(Ready(described, at_beginning, rows))
    return state.hello()


def _script(name: str) -> str:
    """Return a module as a data URL; it imports others by their paths from the folder of the pages."""
    text = (FRONTEND / name).read_text("utf-8")
    text = IMPORT.sub(lambda found: f"{found[1]}{beside(name, found[2])}", text)
    return f"data:text/javascript;base64,{base64.b64encode(text.encode()).decode()}"


def _data(value: object) -> Markup:
    """Return JSON that cannot end a script element; a number that is not finite becomes null."""
    return _safe(to_json(value, inf_nan_mode="null").decode().replace("<", "\\u003c"))


def _safe(text: str) -> Markup:
    return Markup(text)  # noqa: S704 - ours, or without a sign that begins a tag
