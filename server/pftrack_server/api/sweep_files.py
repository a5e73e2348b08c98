"""Sweeps as files: the result to take away, in several forms, finished or as far as it came."""

import asyncio
import shutil
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Literal

from fastapi import APIRouter, Query
from starlette.background import BackgroundTask
from starlette.responses import FileResponse, Response, StreamingResponse

from pftrack.sweep import csv_pieces
from pftrack_server.api.dependencies import AStore, ASweep, SettingsNow
from pftrack_server.errors import ConflictError
from pftrack_server.store import Store
from pftrack_server.sweeps import functions
from pftrack_server.sweeps.computing import ask
from pftrack_server.sweeps.functions import Pictures
from pftrack_server.sweeps.sweep import Sweep

router = APIRouter(prefix="/sweeps", tags=["sweeps"])

PARQUET = "application/vnd.apache.parquet"
REPORT_S = 120.0

Format = Literal["parquet", "csv", "html", "png", "svg"]
PICTURES: Mapping[Format, Pictures] = {"html": "png", "png": "png", "svg": "svg"}


@router.get(
    "/{sweep}/download",
    response_class=Response,
    responses={200: {"content": {PARQUET: {}, "text/csv": {}, "text/html": {}, "application/zip": {}}}},
)
async def download(
    sweep: ASweep,
    store: AStore,
    settings: SettingsNow,
    form: Annotated[Format, Query(alias="format", description="png and svg are archives of all maps.")] = "parquet",
) -> Response:
    """Return what there is of a sweep as a file: all runs as Parquet or CSV, or a report as one page or as pictures."""
    await sweep.look()
    if sweep.done == 0:
        raise ConflictError("No run of this sweep has been computed yet.")
    name = f"{sweep.plan.experiment}-sweep-{sweep.id[:6]}"
    if form == "csv":
        result = await asyncio.to_thread(sweep.results.result)
        return StreamingResponse(csv_pieces(result), media_type="text/csv", headers=_attach(f"{name}.csv"))
    whole = store.files.sweep(sweep.id)
    if form == "parquet" and whole.exists():
        return FileResponse(whole, media_type=PARQUET, filename=f"{name}.parquet")
    store.disk_budget.check()
    folder = store.files.new_outgoing()
    folder.mkdir(mode=0o700)
    after = BackgroundTask(shutil.rmtree, folder, ignore_errors=True)
    try:
        if form == "parquet":
            path = await asyncio.to_thread(_gather, sweep, folder / "sweep.parquet")
            return FileResponse(path, media_type=PARQUET, filename=f"{name}.parquet", background=after)
        await _report(sweep, store, folder, settings.max_sweeps_bytes, pictures=PICTURES[form])
        if form == "html":
            page = next(folder.glob("*.html"))
            return FileResponse(page, media_type="text/html", filename=f"{name}.html", background=after)
        path = await asyncio.to_thread(_zip, folder, f"{name}.zip")
        return FileResponse(path, media_type="application/zip", filename=f"{name}.zip", background=after)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _attach(name: str) -> dict[str, str]:
    return {"Content-Disposition": f'attachment; filename="{name}"'}


async def _report(sweep: Sweep, store: Store, folder: Path, largest_file: int, *, pictures: Pictures) -> None:
    """Have a child write the report of a sweep into a folder."""
    result = store.files.sweep(sweep.id)
    filters = await asyncio.to_thread(store.files.filters_of, sweep.plan.single(0).recipe)
    await ask(functions.report, result, folder, pictures, filters, patience_s=REPORT_S, file_bytes=largest_file)


def _gather(sweep: Sweep, path: Path) -> Path:
    """Write the runs that are there into one file."""
    import pyarrow.parquet as pq  # noqa: PLC0415 - seldom needed

    from pftrack.sweep.journal import metadata  # noqa: PLC0415
    from pftrack.sweep.table import schema  # noqa: PLC0415

    with pq.ParquetWriter(path, schema(sweep.plan).with_metadata(metadata(sweep.plan)), compression="zstd") as writer:
        for piece in sweep.results.result().pieces():
            writer.write_table(piece)
    return path


def _zip(folder: Path, name: str) -> Path:
    path = folder / name
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED, strict_timestamps=False) as archive:
        for picture in _pictures(folder):
            archive.write(picture, picture.name)
    return path


def _pictures(folder: Path) -> Iterator[Path]:
    yield from sorted([*folder.rglob("*.png"), *folder.rglob("*.svg")])
