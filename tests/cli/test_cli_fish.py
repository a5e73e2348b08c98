"""The fish on the command line: in the tank, and on a film from the mark of a long body."""

from pathlib import Path

from tests.cli.commands import Ask, Call, refused

MARK = "body:29,33.5,20,33.5,20,33.5,4"


def test_a_run_says_whether_it_succeeded(ask: Ask) -> None:
    """`run fish --json` has `success` and `mean_error_px`."""
    said = ask("run", "fish", "--frames", 6)
    assert (said["success"], said["success_measure"]) == (True, "hit_rate")
    assert 0 < said["mean_error_px"] < 6


def test_a_film_is_followed_from_a_body(ask: Ask, clip: Path) -> None:
    """Seven numbers mark a body without a tail; the boxes of the truth decide on success."""
    said = ask("run", "fish", "--video", clip, "--mark", MARK, "--truth", clip.with_name("truth.csv"))
    assert said["success"] is True
    assert (said["parameters"]["half_length_px"], said["parameters"]["foreground"]) == (4.5, "colour")
    assert "told from the water by its colour" in said["suitability_remark"]


def test_what_is_no_body_is_refused(call: Call, clip: Path) -> None:
    """Too few numbers, a place outside the picture, and no mark at all are told in a sentence."""
    for mark, words in (
        ("body:1,2,3", "expected 7 finite numbers"),
        ("body:290,33,20,33,20,33,4", "mark.head must be within the picture of 120 x 80 px"),
        ("box:20,30,10,8", "fish takes no mark of kind 'box', only body"),
    ):
        refused(call("run", "fish", "--video", clip, "--mark", mark), 2, words)
    needs = "--video needs --mark body:head x,y,root x,y,tip x,y,half width"
    refused(call("run", "fish", "--video", clip), 2, needs)
