"""The command line's gallery of failures."""

from pathlib import Path

from tests.cli.commands import Ask, Call, refused


def test_failures_are_listed_with_their_numbers(call: Call, ask: Ask) -> None:
    """`failures list` prints ten names, `--json` more of each; `show` has an experiment's own."""
    code, out, _ = call("failures", "list")
    assert code == 0
    listed = ask("failures", "list")
    assert [each["number"] for each in listed] == list(range(1, 11))
    assert all(each["id"] in out for each in listed)
    assert all(each["diagnosis"].endswith(".") and each["cure"].endswith(".") for each in listed)
    own = [each["id"] for each in listed if each["experiment"] == "linkage"]
    shown = call("show", "linkage")[1]
    assert all(name in shown for name in own)
    assert sorted(ask("show", "linkage")["failures"]) == sorted(own)


def test_a_failure_says_what_happens_in_numbers(call: Call, ask: Ask) -> None:
    """`failures run 4` says what is measured; cured it says that it does not fail, on the same seed."""
    code, out, _ = call("failures", "run", "4")
    assert code == 0
    assert "It fails in this way." in out
    assert "is left behind: it goes 5.2 px a frame, and the estimate 3.8 px that way; in frame" in out
    assert "distance from the truth, px" in out.split("From frame 7 on")[1]
    told = [ask("failures", "run", "wrong-dynamics", *how) for how in ([], ["--cured"])]
    assert [each["shown"] for each in told] == [True, False]
    assert [each["recipe"]["tracker"] for each in told] == ["guided", "condensation"]
    assert told[0]["recipe"]["seed"] == told[1]["recipe"]["seed"]
    assert told[0]["lost_frames"][0] == told[0]["frame"] + 1
    assert told[0]["numbers"]["believed"] < told[0]["numbers"]["true"]
    assert told[0]["measured"] == told[1]["measured"]
    assert told[0]["measured"][0]["failing"] > 10 * told[0]["measured"][0]["cured"]
    assert "does not fail in this way" in call("failures", "run", "4", "--cured")[1]


def test_a_failure_is_drawn_for_print(call: Call, tmp_path: Path) -> None:
    """`failures figure 4` writes both errors in one column, the same bytes each time; other files are refused."""
    written = [tmp_path / name for name in ("one.svg", "other.svg")]
    for path in written:
        assert call("failures", "figure", "4", "--out", str(path))[0] == 0
    one, other = (path.read_text() for path in written)
    assert one == other
    assert all(words in one for words in ("Wrong dynamics", "error, px", ">fails<", ">cured<"))
    assert 'width="252pt"' in one
    refused(call("failures", "figure", "4", "--out", str(tmp_path / "one.gif")), 2, "expected a file .png or .svg")


def test_a_failure_that_is_not_there_is_refused(call: Call) -> None:
    """An unknown name or number, or a seed that is none, is wrong use, and says what there is."""
    refused(call("failures", "run", "11"), 2, "failure must be one of 1 sample-impoverishment", "got '11'")
    refused(call("failures", "run", "4", "--seed", "x"), 2, "--seed must be a whole number", "'x'")
