"""The hand on the command line: what a run says of itself, and what it says where there is no hand."""

from pathlib import Path

from tests.cli.commands import Ask, Call, refused


def test_a_run_says_how_often_it_was_right(ask: Ask) -> None:
    """`run hand --json` has the shares of right hands, the error of the tips, and how fast it was."""
    said = ask("run", "hand", "--frames", 4, "--set", "beam_width=2")
    assert said["best_right_share"] == said["any_right_share"] == said["backtracked_right_share"] == 1.0
    assert 0.0 < said["tip_error_palms"] < 0.2
    assert said["frames_per_second"] > 0.0


def test_a_film_without_a_hand_is_refused_with_what_is_seen(call: Call, clip: Path) -> None:
    """The sentence says what would help; a mark of another kind is refused by its name."""
    refused(call("run", "hand", "--video", clip), 1, "mark the tips of its fingers")
    marked = call("run", "hand", "--video", clip, "--mark", "box:20,30,10,8")
    refused(marked, 2, "hand takes no mark of kind 'box', only points")
