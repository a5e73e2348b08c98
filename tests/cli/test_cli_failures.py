"""The command line's gallery of failures."""

from pathlib import Path

from tests.cli.commands import Ask, Call, refused


def test_failures_are_listed_with_their_numbers(call: Call, ask: Ask) -> None:
    """`failures list` prints ten names, `--json` more of each; `show` has those of an experiment."""
    code, out, _ = call("failures", "list")
    assert code == 0
    listed = ask("failures", "list")
    assert [each["number"] for each in listed] == list(range(1, 11))
    assert all(each["id"] in out for each in listed)
    own = [each["id"] for each in listed if each["experiment"] == "linkage"]
    shown = call("show", "linkage")[1]
    assert all(name in shown for name in own)
    assert sorted(ask("show", "linkage")["failures"]) == sorted(own)


def test_a_failure_is_described_in_numbers(call: Call, ask: Ask) -> None:
    """`failures run 4` prints measurements; with `--cured` it does not fail with the same seed."""
    code, out, _ = call("failures", "run", "4")
    assert code == 0
    assert "The run shows this failure." in out
    assert "is left behind: it goes 5.2 px a frame, and the estimate 3.8 px that way; in frame" in out
    assert "distance from the truth, px" in out.split("From frame 7 on")[1]
    told = [ask("failures", "run", "wrong-dynamics", *how) for how in ([], ["--cured"])]
    assert [each["shown"] for each in told] == [True, False]
    assert [each["recipe"]["tracker"] for each in told] == ["guided", "condensation"]
    assert told[0]["recipe"]["seed"] == told[1]["recipe"]["seed"]
    assert told[0]["measured"] == told[1]["measured"]
    assert told[0]["measured"][0]["failing"] > 10 * told[0]["measured"][0]["cured"]


def test_a_failure_is_drawn_for_print(call: Call, tmp_path: Path) -> None:
    """`failures figure 4` writes both errors in one column; other files are refused."""
    path = tmp_path / "one.svg"
    assert call("failures", "figure", "4", "--out", path)[0] == 0
    one = path.read_text()
    assert all(words in one for words in ("Wrong dynamics", "error, px", ">fails<", ">cured<", 'width="252pt"'))
    refused(call("failures", "figure", "4", "--out", str(tmp_path / "one.gif")), 2, "expected a file .png or .svg")


def test_an_unknown_failure_is_refused(call: Call) -> None:
    """The line lists the known ones; a seed must be a number."""
    refused(call("failures", "run", "11"), 2, "failure must be one of 1 sample-impoverishment", "got '11'")
    refused(call("failures", "run", "4", "--seed", "x"), 2, "--seed must be a whole number", "'x'")
