"""The page of a run put together: texts, plots and figures in HTML, scripts and data behind them."""

import base64
import json
import re
from collections.abc import Iterable, Iterator, Mapping
from html import escape
from pathlib import Path
from typing import Any

from pftrack.core.model.series import Reading
from pftrack.core.version import __version__
from pftrack.output.displays import explanation_html, format_reading, readings_of, summary_lines, track
from pftrack.runs.loss import Loss
from pftrack.runs.manifest import citation_of, manifest_of, title_of
from pftrack.runs.run import Run
from pftrack_server.viewer.camera import FLAT_RAD, FULL_RELIEF_RAD, RELIEF_STEPS
from pftrack_server.viewer.modules import join
from pftrack_server.viewer.standalone.plots import PagePlot, plots_of
from pftrack_server.viewer.standalone.recording import Recording, record

MOST_BYTES = 6_500_000
"""Of a recording of up to 300 frames: as text in the page it is a third larger, and viser's client adds 0.8 MB."""
USUAL_FRAMES = 300
PAGE = Path(__file__).parent / "page"
SCRIPTS = ("sent.js", "clock.js", "scene.js", "page.js")
PLACE = re.compile(r"{{(\w+)}}")
POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob: data:; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; connect-src data: blob:; worker-src blob:; form-action 'none'"
)
"""Nothing is fetched from anywhere."""


def write_page(run: Run, path: Path) -> Iterator[tuple[int, int]]:
    """Write a run, as far as it has been computed, as one HTML page that needs no server and no network.

    Args:
        run: It is moved to each of its frames.
        path: Where to.

    Yields:
        How many frames are done, of how many.

    Raises:
        OSError: The file cannot be written.
    """
    share = max(1.0, (run.computed + 1) / USUAL_FRAMES)
    recording = yield from record(run, int(share * MOST_BYTES))
    path.write_text(document(run, recording), encoding="utf-8")


def document(run: Run, recording: Recording) -> str:
    """Return the page of a run and its recording."""
    views = [
        f'<button type="button" data-view="{escape(view["name"])}" aria-pressed="{str(first).lower()}">'
        f"{escape(view['title'])}</button>"
        for view, first in zip(recording.views, (True, *[False] * len(recording.views)), strict=False)
    ]
    layers = [
        f'<label><input type="checkbox" value="{escape(name)}" checked> {escape(title)}</label>'
        for name, title in recording.layers
    ]
    legend = [f'<li><i style="background:{colour}"></i>{escape(words)}</li>' for colour, words in recording.legend]
    readings = readings_of(run.experiment, run.diagnostics)
    parts = {
        "policy": escape(POLICY),
        "version": __version__,
        "title": escape(title_of(run)),
        "question": escape(run.experiment.question),
        "style": (PAGE / "style.css").read_text(encoding="utf-8"),
        "views": "".join(views),
        "layers": "".join(layers),
        "legend": "".join(legend),
        "remarks": "".join(f'<p class="muted">{escape(line)}</p>' for line in _remarks(recording)),
        "plots": "".join(_figure(plot) for plot in plots_of(run)),
        "readings": "".join(f"<dt>{escape(reading.title)}</dt><dd></dd>" for reading in readings),
        "track": track(run),
        "last": str(run.computed),
        "summary": _list(summary_lines(run)),
        "explanation": "" if run.explained is None else f'<div class="wide">{explanation_html(run.explained)}</div>',
        "citation": escape(citation_of(run)),
        "recipe": escape(json.dumps(run.recipe.with_footage(path=None).as_dict(), indent=2, ensure_ascii=False)),
        "manifest": _data(manifest_of(run)),
        "run": _data(_run(run, recording, readings)),
        "player": _data(recording.player),
        "packed": base64.b64encode(recording.packed).decode(),
        "pictures": base64.b64encode(b"".join(recording.pictures)).decode(),
        "script": join(PAGE / name for name in SCRIPTS),
    }
    return _fill((PAGE / "page.html").read_text(encoding="utf-8"), parts)


def _remarks(recording: Recording) -> Iterator[str]:
    """Yield what the scene leaves out."""
    every = recording.kept[1] - recording.kept[0] if len(recording.kept) > 1 else 1
    if every > 1:
        yield f"One of {every} frames is in the scene; the figures have all of them."
    if recording.thinned > 1:
        yield f"One of {recording.thinned} points of each large cloud is drawn."


def _figure(plot: PagePlot) -> str:
    return (
        f'<figure class="plot" title="{escape(plot.description)}"><figcaption>{escape(plot.title)}</figcaption>'
        f'<div class="axes" data-first="{plot.first:.5f}" data-last="{plot.last:.5f}">{plot.svg}'
        '<i class="cursor"></i></div></figure>'
    )


def _run(run: Run, recording: Recording, readings: Iterable[Reading]) -> dict[str, Any]:
    rows = run.diagnostics
    return {
        "frames": len(rows),
        "rate_hz": run.source.frame_rate_hz,
        "kept": recording.kept,
        "captions": recording.captions,
        "gone": Loss.of(run.diagnostics).lost.astype(int).tolist(),
        "readings": [[format_reading(run.experiment, reading, row) for row in rows] for reading in readings],
        "views": recording.views,
        "sizes": [len(file) for file in recording.pictures],
        "relief": {"flat": FLAT_RAD, "full": FULL_RELIEF_RAD, "steps": RELIEF_STEPS},
    }


def _list(pairs: Mapping[str, str]) -> str:
    return f"<dl>{''.join(f'<dt>{escape(name)}</dt><dd>{escape(value)}</dd>' for name, value in pairs.items())}</dl>"


def _data(value: object) -> str:
    """Return JSON that no browser takes for the end of a script."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")


def _fill(template: str, parts: Mapping[str, str]) -> str:
    return PLACE.sub(lambda place: parts[place[1]], template)
