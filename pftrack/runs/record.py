"""Records: a run as one small file that reproduces the same numbers.

A `.pft` file is a zip archive of `run.json` (recipe, number of computed frames, hash of all estimates) and
`diagnostics.npz` (the numbers of every frame, readable without computing). With `states=True` it also has the particles
of every frame in `states.npz`. The file is written under another name and renamed, so that a crash leaves the old file
or the new one, never half of one.
"""

import io
import json
import zipfile
import zlib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pftrack.core.arrays import Floats
from pftrack.core.files import part_of, settle
from pftrack.core.model.parameters import Value, flat
from pftrack.core.model.recipe import Recipe
from pftrack.core.numerics import machine
from pftrack.core.refusal import RefusedError, first_problem
from pftrack.core.version import __version__
from pftrack.experiments.own.code import with_texts
from pftrack.runs.loss_probability import columns_of
from pftrack.runs.table import clouds_of

if TYPE_CHECKING:
    from pftrack.runs.run import Run

FORMAT: Literal[2] = 2
LARGEST_RECORD_BYTES = 16 * 1024 * 1024
LARGEST_DIAGNOSTICS_BYTES = 256 * 1024 * 1024

DAMAGED = (OSError, EOFError, zipfile.BadZipFile, zlib.error, KeyError, ValueError, NotImplementedError, RuntimeError)
"""Errors of reading a file that is not an archive, or is truncated or changed."""


class Record(BaseModel):
    """The content of `run.json`.

    Attributes:
        format: Name of the format.
        version: Version of the format.
        pftrack: Version of pftrack that wrote the file.
        recipe: Recipe that reproduces the run.
        computed: Number of computed frames.
        estimates_sha256: Hash of their estimates.
        computed_on: Processor, compiled target and versions of libraries; empty if unknown.
    """

    model_config = ConfigDict(extra="ignore")

    format: Literal["pftrack-run"] = "pftrack-run"
    version: Literal[2] = FORMAT
    pftrack: str = __version__
    recipe: Recipe
    computed: Annotated[int, Field(ge=1)]
    estimates_sha256: str
    computed_on: dict[str, str] = {}


@dataclass(frozen=True, eq=False)
class Saved:
    """The description of a run in a file, and its estimates.

    Attributes:
        record: Description of the run.
        estimates: (L, d) estimates of all frames; None if the file has none.
    """

    record: Record
    estimates: Floats | None


def describe(run: "Run", *, path: str | None = None) -> Record:
    """Return the description that reproduces a run.

    Args:
        run: The run.
        path: Path of the recording relative to the new file, if it is to be stored.
    """
    return Record.model_construct(
        recipe=with_texts(run.recipe.with_footage(path=path)).model_copy(update={"defaults": _defaults(run)}),
        computed=run.computed + 1,
        estimates_sha256=run.estimates_sha256,
        computed_on=dict(machine.describe_platform()),
    )


def _defaults(run: "Run") -> dict[str, Value]:
    """Return the parameters that the run does not set at frame 0."""
    chosen = {name for change in run.timeline.changes if change.frame == 0 for name in change.values}
    return {name: value for name, value in flat(run.setup.parameters).items() if name not in chosen}


def save(run: "Run", path: Path, *, states: bool = False, footage_path: str | None = None) -> None:
    """Write a run to a file.

    Args:
        run: The run; its computed part is written.
        path: Path of the file; an existing file is replaced.
        states: Whether to keep the particles of every frame, for which the run is computed once more.
        footage_path: Path of the recording relative to the file, if it is to be stored.

    Raises:
        OSError: The file cannot be written; an existing file is left as it was.
    """
    part = part_of(path)
    try:
        # `ZipInfo` has a fixed time; the clock may be before 1980, which zip refuses.
        with zipfile.ZipFile(part, "w") as archive:
            told = describe(run, path=footage_path).model_dump_json(indent=1)
            archive.writestr(zipfile.ZipInfo("run.json"), told, zipfile.ZIP_DEFLATED)
            archive.writestr(zipfile.ZipInfo("diagnostics.npz"), _pack(columns_of(run)), zipfile.ZIP_DEFLATED)
            if states:
                # The content is compressed already; a second time would gain nothing.
                archive.writestr(zipfile.ZipInfo("states.npz"), _pack(_states(run)))
        settle(part, path)
    finally:
        part.unlink(missing_ok=True)


def read(path: Path) -> Record:
    """Read the description of a run from a file, without computing anything.

    Raises:
        RefusedError: The file is not a saved run, or this version cannot read it.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            is_larger = archive.getinfo("run.json").file_size > LARGEST_RECORD_BYTES
            raw = None if is_larger else json.loads(archive.read("run.json"))
    except FileNotFoundError:
        raise RefusedError(f"the file {path} does not exist") from None
    except DAMAGED:
        raise RefusedError(f"{path.name} is not a saved run, or was cut short; expected a .pft file") from None
    if is_larger:
        raise RefusedError(f"{path.name} is not a saved run: its description is larger than 16 MiB")
    version = raw.get("version") if isinstance(raw, dict) else None
    if isinstance(version, int) and version != FORMAT:
        remedy = "update pftrack" if version > FORMAT else "it is older than any release"
        raise RefusedError(f"{path.name} was saved in format {version}, this version reads format {FORMAT}; {remedy}")
    try:
        return Record.model_validate(raw)
    except ValidationError as error:
        try:
            place = ".".join(str(part) for part in first_problem(error.errors())["loc"])
        except RefusedError as cause:
            raise RefusedError(f"{path.name} is not a saved run of this version: {cause}") from None
    raise RefusedError(f"{path.name} is not a saved run: {place or 'its description'} is missing or wrong")


def read_saved(path: Path) -> Saved:
    """Read the description of a run and its estimates from a file.

    Raises:
        RefusedError: See `read`.
    """
    record = read(path)
    estimates = _columns_in(path, ("estimate",)).get("estimate")
    if estimates is None or estimates.ndim != 2 or estimates.dtype.kind != "f":
        return Saved(record, None)  # the recipe still reproduces the run
    return Saved(record, np.asarray(estimates, np.float64))


def read_columns(path: Path) -> dict[str, np.ndarray[Any, Any]]:
    """Read the columns of a file by name; none if they are damaged."""
    return _columns_in(path, None)


def _columns_in(path: Path, names: Collection[str] | None) -> dict[str, np.ndarray[Any, Any]]:
    """Return some or all columns of a file; none if one of them is too large or damaged."""
    try:
        with zipfile.ZipFile(path) as archive:
            if archive.getinfo("diagnostics.npz").file_size > LARGEST_DIAGNOSTICS_BYTES:
                return {}
            data = io.BytesIO(archive.read("diagnostics.npz"))
        with zipfile.ZipFile(data) as inside:  # compressed, it may be a thousand times as large
            wanted = [
                entry for entry in inside.infolist() if names is None or entry.filename.removesuffix(".npy") in names
            ]
            if sum(entry.file_size for entry in wanted) > LARGEST_DIAGNOSTICS_BYTES:
                return {}
        with np.load(data, allow_pickle=False) as columns:
            return {name: columns[name] for name in (entry.filename.removesuffix(".npy") for entry in wanted)}
    except DAMAGED:
        return {}


def _states(run: "Run") -> dict[str, np.ndarray[Any, Any]]:
    twin = run.branch(run.computed)
    arrays: dict[str, np.ndarray[Any, Any]] = {}
    for frame in range(run.computed + 1):
        for name, array in twin.seek(frame).state.arrays().items():
            arrays[f"{name}_{frame}"] = array
    return arrays | clouds_of(twin)


def _pack(arrays: Mapping[str, np.ndarray[Any, Any]]) -> bytes:
    """Pack arrays as NumPy does in half the time: particles are noise, which hardly compresses."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
    return buffer.getvalue()
