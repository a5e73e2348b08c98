"""The manifest of an export: the meaning of its numbers, and everything needed to reproduce them.

It holds the version of pftrack, the recipe, hashes of recipe, recording and estimates, the computed frames, title and
unit of every column, and citations. It holds no time, so equal runs have equal manifests. Formats that can include it
do so; other exports have it in a separate file.
"""

import hashlib
import json
from typing import Any

from pftrack.core.model.band import DOUBTS
from pftrack.core.model.glossary import Citation
from pftrack.core.numerics import machine
from pftrack.core.version import __version__
from pftrack.runs.loss import Loss
from pftrack.runs.run import Run
from pftrack.runs.table import columns_in

FORMAT = "pftrack-manifest"


def manifest_of(run: Run) -> dict[str, Any]:
    """Return the manifest of the computed part of a run as JSON values."""
    recipe = run.recipe.with_footage(path=None)
    footage, loss = recipe.footage, Loss.of(run.diagnostics)
    return {
        "format": FORMAT,
        "version": 1,
        "pftrack": __version__,
        "title": title_of(run),
        "frames": {"computed": run.computed + 1, "of": run.frames, "rate_hz": run.source.frame_rate_hz},
        "recipe": recipe.as_dict(),
        "sha256": {
            "recipe": hashlib.sha256(json.dumps(recipe.as_dict(), sort_keys=True).encode()).hexdigest(),
            "estimates": run.estimates_sha256,
            **({"recording": footage.sha256} if footage and footage.sha256 else {}),
        },
        "loss": {"lost_frames": loss.lost_frames, "first_lost_frame": loss.first_lost_frame, "by": loss.witness},
        **{doubt: doubt in run.doubts for doubt in DOUBTS},
        "computed_on": dict(machine.describe_platform()),
        "columns": [{"name": it.name, "title": it.title, "unit": it.unit} for it in columns_in(run)],
        "citation": citation_of(run),
        "references": [one.as_dict() for one in run.experiment.texts.references],
    }


def embed(run: Run) -> str:
    """Return the manifest of a run as one line of ASCII JSON, for other formats to include."""
    return json.dumps(manifest_of(run))


def title_of(run: Run) -> str:
    """Return a title of a run in one line."""
    tracker = run.experiment.trackers[run.tracker].title
    return f"{run.experiment.title}, {tracker}, seed {run.seed}"


def extent_of(run: Run) -> str:
    """Return as text which frames of a run were computed."""
    last = run.computed
    if last + 1 == run.frames:
        return f"all {run.frames} frames"
    return f"frames 0 to {last}, {last + 1} of {run.frames}"


def citation_of(run: Run) -> str:
    """Return the citation of a run as plain text: program with version, run, and documents."""
    lines = [
        f"Computed with pftrack {__version__}: {title_of(run)}; {extent_of(run)}.",
        f"SHA-256 of the estimates: {run.estimates_sha256}.",
    ]
    if run.experiment.texts.references:
        lines += ["", "The method and the experiment come from:", *_list_citations(run.experiment.texts.references)]
    return "\n".join(lines) + "\n"


def bibtex_of(run: Run) -> str:
    """Return the citation of a run as BibTeX entries."""
    own = (
        "@software{pftrack,\n  author = {{the pftrack authors}},\n  title = {pftrack},\n"
        f"  version = {{{__version__}}},\n  note = {{{title_of(run)}; {extent_of(run)}}},\n}}\n"
    )
    return "\n".join((own, *(one.bibtex for one in run.experiment.texts.references)))


def _list_citations(references: tuple[Citation, ...]) -> list[str]:
    return [f"- {one.text}" for one in references]
