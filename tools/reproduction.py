"""The pages' tables of reproduced results, written from the record next to them.

`python -m tools.reproduction` puts the tables between `<!-- reproduction NAME -->` and `<!-- end -->` in
docs/explanation/reproduction.md, and the sentence with the counts in the README, from the record
docs/explanation/reproduction.json, which `make reproduce` computes. A test compares pages and record.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from textwrap import fill

from pftrack.reproduce import RESULTS, is_older
from pftrack.reproduce.finding import Entry, Finding, not_run, read_record

__all__ = [
    "PAGE",
    "README",
    "RECORD",
    "ROOT",
    "STUDIES",
    "blocks",
    "fill_page",
    "findings_of",
    "sentence",
    "table",
    "write",
]

ROOT = Path(__file__).parents[1]
PAGE, RECORD = (ROOT / "docs/explanation" / name for name in ("reproduction.md", "reproduction.json"))
README = ROOT / "README.md"

STUDIES: dict[str, tuple[str, ...]] = {
    "filters on signals (Bando 2007, ch. 2)": ("kalman-sine", "sample-count-signal", "dimension", "one-step"),
    "occlusion and look-alikes (Bando 2007, ch. 3)": (
        "occlusion",
        "sensitivity",
        "wide-swing",
        "sample-count",
        "maps",
        "learning",
        "learning-clutter",
    ),
    "prism (Bando 2007, ch. 4)": ("prism", "prism-readings", "prism-perspective", "pose-filters"),
    "head (Bando 2007, ch. 4)": ("head",),
    "bands of a pose": ("calibration",),
    "shape from tracks (Bando 2007, ch. 4)": ("structure", "structure-face"),
    "window by its colours (Kagami 2012)": ("histogram", "histogram-trackers"),
    "trajectories (Ichimura and Ikoma)": ("trajectories", "corners"),
    "fish (Mitsugami et al. 2009)": ("fish-offline", "fish", "fish-ablations"),
    "hand (Shimada 1997, ch. 2)": ("hand", "hand-switches", "hand-scoring", "hand-particles", "hand-steps"),
    "chain of links (Shimada 1997, ch. 3 to 5)": tuple(name for name in RESULTS if name.startswith("linkage-")),
}

SENTENCE = re.compile(r"[\d,]+\s+of\s+[\d,]+\s+reference\s+figures\s.*?older\s+than\s+the\s+code\.", re.DOTALL)
UNFINISHED = "it had not been computed when this page was written"


def findings_of(record: Mapping[str, Entry], names: Iterable[str] = tuple(RESULTS)) -> list[Finding]:
    """Return the findings of results, in order; results that are not in the record are skipped."""
    return [
        finding
        for name in names
        for finding in (record[name].findings if name in record else (not_run(name, UNFINISHED),))
    ]


def sentence(record: Mapping[str, Entry]) -> str:
    """Return the counts in sentences."""
    found = findings_of(record)
    reproduced, better, differ = (_count(found, verdict) for verdict in ("reproduced", "better", "differs"))
    explained, older = sum(one.explained for one in found), len(_older(record))
    return (
        f"{reproduced} of {reproduced + better + differ:,} reference figures reproduce, {better} are better and "
        f"{differ} differ: {explained} for a known cause, {differ - explained} for an unknown one. "
        f"{older} of {len(record)} results are older than the code."
    )


def blocks(record: Mapping[str, Entry]) -> dict[str, str]:
    """Return the generated parts of the page by name."""
    missing = [one for one in findings_of(record) if one.verdict == "not run"]
    return {
        "run": _run(record),
        "counts": _counts(record),
        "differences": _differences(record),
        "missing": table(("result", "why"), [(one.result, one.reason) for one in missing]) if missing else "All were.",
    }


def write() -> None:
    """Rewrite the generated parts of the pages."""
    record = read_record(RECORD)
    fill_page(PAGE, blocks(record))
    readme = README.read_text(encoding="utf-8")
    told = fill(sentence(record), 130)
    README.write_text(SENTENCE.sub(told, readme), encoding="utf-8")


def fill_page(file: Path, texts: Mapping[str, str]) -> None:
    """Write texts into a page, each between the marks of its name."""
    page = file.read_text(encoding="utf-8")
    for name, text in texts.items():
        page = _between(name).sub(lambda found, text=text: f"{found[1]}\n{text}\n{found[3]}", page)  # type: ignore[misc]
    file.write_text(page, encoding="utf-8")


def _between(name: str) -> re.Pattern[str]:
    return re.compile(rf"(<!-- reproduction {name} -->\n)(.*?)(\n<!-- end -->)", re.DOTALL)


def _run(record: Mapping[str, Entry]) -> str:
    full = [entry for entry in record.values() if entry.form == "full"]
    quick = [entry for entry in record.values() if entry.form == "quick"]
    minutes = sum(entry.seconds for entry in record.values()) / 60.0
    revisions = sorted({entry.revision for entry in record.values()})
    told = [f"{len(full)} of {len(RESULTS)} results were computed with all trials"]
    if quick:
        names = ", ".join(f"`{name}`" for name, entry in record.items() if entry.form == "quick")
        told.append(f"{len(quick)} in the quick form alone, with few trials or none ({names})")
    if len(record) < len(RESULTS):
        told.append(f"{len(RESULTS) - len(record)} not at all")
    older = _older(record)
    return (
        f"{', '.join(told)}: {minutes:.0f} minutes of processor time, at revision {' and '.join(revisions)}.\n\n"
        f"{len(older)} of {len(record)} results are older than the code."
    )


def _older(record: Mapping[str, Entry]) -> list[str]:
    return [name for name, entry in record.items() if is_older(name, entry)]


def _counts(record: Mapping[str, Entry]) -> str:
    rows = [(title, findings_of(record, names)) for title, names in STUDIES.items()]
    rows.append(("all", [one for _, found in rows for one in found]))
    columns = (
        "study",
        "reproduced",
        "better",
        "differs, cause known",
        "differs, cause unknown",
        "differs, not expected",
        "our own figure",
        "not run",
    )
    return table(
        columns,
        [
            (
                title,
                _count(found, "reproduced"),
                _count(found, "better"),
                sum(one.explained for one in found),
                sum(one.verdict == "differs" and one.known and not one.explained for one in found),
                sum(one.fails for one in found),
                _count(found, "our own figure"),
                _count(found, "not run"),
            )
            for title, found in rows
        ],
    )


def _differences(record: Mapping[str, Entry]) -> str:
    groups: dict[tuple[str, str, str], list[Finding]] = {}
    for name in RESULTS:
        for one in findings_of(record, [name]):
            if one.verdict in {"differs", "better"}:
                groups.setdefault((f"`{name}`", _verdict(one), one.reason), []).append(one)
    rows = [
        (name, verdict, len(found), _figure(max(found, key=_distance)), reason)
        for (name, verdict, reason), found in groups.items()
    ]
    return table(("result", "verdict", "figures", "furthest (reference)", "reason"), rows)


def _distance(one: Finding) -> float:
    """Return a figure's deviation in tolerances; 0 for a statement."""
    return abs(one.ours - one.reference) / one.tolerance if one.reference is not None and one.tolerance else 0.0


def _figure(one: Finding) -> str:
    return _number(one.ours) if one.reference is None else f"{_number(one.ours)} ({_number(one.reference)})"


def _verdict(one: Finding) -> str:
    if one.verdict == "better":
        return "better"
    if one.fails:
        return "differs, not expected"
    return "differs, cause known" if one.explained else "differs, cause unknown"


def table(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as Markdown."""
    lines = [columns, ["---"] * len(columns), *rows]
    return "\n".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |" for line in lines)


def _number(value: float) -> str:
    return "" if value != value else f"{value:.3g}"  # noqa: PLR0124 - NaN is the only number that is not itself


def _count(found: Iterable[Finding], verdict: str) -> int:
    return sum(one.verdict == verdict for one in found)


if __name__ == "__main__":
    write()
