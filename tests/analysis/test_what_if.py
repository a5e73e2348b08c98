import json
from dataclasses import replace
from itertools import islice

import pytest

import pftrack
from pftrack.analysis.alternatives import KINDS, alternatives
from pftrack.analysis.counterfactuals import Report, find_loss, join, read_record, record, what_if
from pftrack.analysis.diagnosis import diagnose
from pftrack.core.model.parameters import flat
from pftrack.core.refusal import RefusedError
from pftrack.runs.run import Run


@pytest.fixture(scope="module")
def lost() -> Run:
    """A run that a pillar has hidden the ball from for too long."""
    return pftrack.run("ball", preset="too-wide", frames=45)


def test_a_cure_opens_as_a_branch_that_holds(lost: Run) -> None:
    """All seeds of half a pillar hold and hardly one of the whole; a seed's verdict is that of the branch with it."""
    *_, report = what_if(lost, 7, rounds=(1, 2), allow=lambda tracker, _: tracker in {"h-spf", "apf"})
    assert (report.loss, report.end, report.judged, report.is_complete) == (7, 37, 10, True)
    assert report.begin < report.loss
    best = report.best_first[1]
    assert best.alternative.values == {"occlusion_width_px": 50}
    assert (best.holding, best.runs, report.baseline.holding) == (2, 2, 0)
    for finding in report.best_first[:3]:
        for seed, held in islice(finding.held.items(), 2):
            branch = lost.branch(report.begin, {**finding.alternative.values, "seed": seed})
            branch.seek(report.end)
            settled = branch.diagnostics[report.end - report.judged + 1 : report.end + 1]
            assert held == (not any(row.lost for row in settled)), finding.alternative.title


def test_alternatives_follow_from_roles(lost: Run) -> None:
    """Particles times 4 and by 4, other numbers times and by 2, choices each; nothing that the tracker ignores.

    A limit on particles leaves out what exceeds it, and nothing else.
    """
    found = {it.title: it for it in alternatives(lost, 1)}
    assert next(iter(found)) == "Same settings, other seeds"
    assert found["Particles 800 to 3,200"].values == {"sample_count": 3200}
    assert found["Particles 800 to 200"].values == {"sample_count": 200}
    assert found["Process noise 3 px to 6 px"].values == {"process_noise_px": 6.0}
    assert found["Occluder width 100 px to 50 px"].kind == "world"
    assert found["Resampling systematic to multinomial"].values == {"resampling": "multinomial"}
    assert {it.values.get("tracker") for it in found.values() if it.kind == "tracker"} == {
        name for name in lost.experiment.trackers if name != lost.tracker
    }
    # A memory of 100 frames is doubled and halved, and one that never ends is halved.
    assert found["Forgetting 0.99 to 0.995"].values == {"forgetting": 0.995}
    assert found["Velocity retention 1 to 0.5"].values == {"velocity_retention": 0.5}
    assert not any(it.parameter == "measurement_noise_px" for it in found.values())  # h-spf reads none
    kinds = [KINDS.index(it.kind) for it in found.values()]
    assert kinds == sorted(kinds)
    few = {it.title for it in alternatives(lost, 1, allow=lambda _, values: flat(values)["sample_count"] <= 800)}
    assert found.keys() - few == {"Particles 800 to 3,200"}


def test_a_run_that_holds_has_nothing_to_explain() -> None:
    """A run without a loss is refused in a sentence, and so is a negative number of seeds."""
    run = pftrack.run("ball", preset="works", frames=5)
    with pytest.raises(RefusedError, match="has not lost its target"):
        next(what_if(run))
    with pytest.raises(ValueError, match="seeds must be at least 0, got -1"):
        run.explain(seeds=-1)


def test_the_loss_that_is_meant(lost: Run) -> None:
    """*Why?* names the same one; a ball seen for nine frames between two losses has not held since the first."""
    assert find_loss(lost) == (15, 7)
    twin = lost.branch(44)
    for gap, expected in ((9, [3, 3, 3, 3]), (10, [3, 3, 19, 19])):
        flags = [3 <= t < 9 or t >= 9 + gap for t in range(45)]
        twin.diagnostics = [replace(row, lost=flag) for row, flag in zip(lost.diagnostics, flags, strict=True)]
        assert [find_loss(twin, frame)[1] for frame in (0, 9 + gap - 1, 9 + gap, 44)] == expected
        report = next(what_if(twin, 44, rounds=(1,)))
        assert report.loss == diagnose(twin, 44).frame
        assert report.loss_sentence == f"Lost in frame {9 + gap}, first in frame 3."


def test_the_best_are_followed_to_the_end_first() -> None:
    """After the comparison soon after the loss each seed is judged at the end, as the branch with it is."""
    run = pftrack.run("ball", preset="too-wide", frames=70)
    reports = list(what_if(run, 7, rounds=(1, 2), allow=lambda tracker, _: tracker == "h-spf"))
    last = reports[-1]
    assert (last.end, last.last, last.done, last.total) == (37, 69, last.total, 4 * (last.planned + 1))
    ahead = [each for each in reports if any(it.at_end for it in each.findings)]
    assert all(it.runs == 2 for it in ahead[0].findings), "all are compared before any is followed"
    _, first = (it for it in ahead[2].findings if it.at_end)
    assert first.share == max(it.share for it in ahead[2].findings[1:])
    for finding in last.best_first[:3]:
        for seed, held in finding.at_end.items():
            branch = run.branch(last.begin, {**finding.alternative.values, "seed": seed})
            branch.finish()
            assert held == (not any(row.lost for row in branch.diagnostics[-10:])), finding.alternative.title


def test_a_run_without_an_end_is_followed_for_a_while(lost: Run) -> None:
    """Trials of a scene that goes on for ten minutes are as long as those of a short one."""
    changes = lost.timeline.changes
    run = Run(lost.experiment, lost.setup, tracker=lost.tracker, seed=lost.seed, frames=18_000, timeline=changes)
    run.seek(40)
    report = next(what_if(run, 7, rounds=(1,)))
    assert (report.end, report.last) == (37, 307)
    assert report.shares(replace(report.baseline, at_end={1: False})).endswith("hold to frame 37, 0 of 1 to frame 307")


def held(report: Report) -> dict[str, dict[int, bool]]:
    return {each.alternative.title: dict(each.held) for each in report.findings}


def test_parts_of_the_work_are_the_whole(lost: Run) -> None:
    """Two that share the changes find together what one finds, passed on as records.

    The first report has one seed of no change; after a round all have as many seeds.
    """
    allow = lambda tracker, _: tracker == "h-spf"  # noqa: E731 - the other trackers take their time
    reports = list(what_if(lost, rounds=(1, 2), allow=allow))
    assert [(it.alternative.kind, it.runs) for it in reports[0].findings] == [("seeds", 1)]
    tried = reports[0].planned
    assert [it.runs for it in reports[tried].findings] == [1] * (tried + 1)
    assert [it.runs for it in reports[-1].findings] == [2] * (tried + 1)
    assert [it.is_complete for it in reports[-2:]] == [False, True]
    whole = reports[-1]
    earlier = replace(whole, first_lost_frame=1)
    assert read_record(json.loads(json.dumps(record(earlier)))).as_dict() == earlier.as_dict()
    parts = [list(what_if(lost, rounds=(1, 2), allow=allow, share=(part, 2))) for part in (0, 1)]
    told = join([read_record(json.loads(json.dumps(record(part[5])))) for part in parts])
    assert not told.is_complete
    assert 0 < len(told.findings) < len(whole.findings)
    found = join([part[-1] for part in parts])
    assert (found.is_complete, found.sentence, found.done) == (True, whole.sentence, whole.done)
    assert held(found) == held(whole)
    assert join([parts[1][-1]]) is None  # no change was tried by the other
