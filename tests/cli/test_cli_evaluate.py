"""`pftrack evaluate otb`."""

import json
from pathlib import Path

from tests.analysis.clips import write_otb
from tests.cli.commands import Call, refused


def test_sequences_are_evaluated(tmp_path: Path, call: Call) -> None:
    """Each sequence gets its figures, next to known published ones; a message names a grey sequence."""
    write_otb(tmp_path / "Couple")
    write_otb(tmp_path / "plain", grey=True)
    code, out, err = call("evaluate", "otb", tmp_path, "--seeds", 1, "--set", "sample_count=50", "--json")
    assert code == 0, err
    first, second = json.loads(out)["sequences"]
    assert (first["name"], first["published"]["CPF"], second["published"]) == ("Couple", 0.567, {})
    assert len(first["success"]) == len(second["precision"]) == 1
    assert "plain is grey" in err
    code, out, _ = call("evaluate", "otb", tmp_path / "Couple", "--seeds", 1)
    assert (code, "CPF" in out) == (0, True)


def test_what_cannot_be_evaluated_is_refused(tmp_path: Path, call: Call) -> None:
    """So are folders without sequences, unknown trackers and parameters, and trackers without a box."""
    refused(call("evaluate", "otb", tmp_path), 1, "not a sequence")
    write_otb(tmp_path / "Couple")
    refused(call("evaluate", "otb", tmp_path, "--tracker", "none"), 2, "must be one of")
    refused(call("evaluate", "otb", tmp_path, "--seeds", 1, "--set", "sharpnes=1"), 2, "did you mean")
    refused(call("evaluate", "otb", tmp_path, "--seeds", 1, "--experiment", "ball"), 1, "believes in no box")
