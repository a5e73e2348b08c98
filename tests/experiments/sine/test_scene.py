import numpy as np
import pytest

from pftrack.core.model.parameters import revise
from pftrack.core.model.source import History
from pftrack.experiments.sine.experiment import SignalSource, SineParameters


@pytest.mark.parametrize(("waveform", "function"), [("sine", np.sin), ("cosine", np.cos)])
def test_truth_turns_once_in_360_frames(waveform: str, function: np.ufunc) -> None:
    """The truth is the sine or cosine of 2 pi t / 360, in every copy."""
    parameters = revise(SineParameters(), {"waveform": waveform, "dimension": 3})
    source = SignalSource(0, parameters)
    for t in (0, 1, 90, 360, 500):
        target = source.frame(t, History(((0, parameters),))).target
        assert np.allclose(target.position, function(2 * np.pi * t / 360))
        assert target.position.shape == (3,)


def test_noise_has_its_spread_and_is_independent() -> None:
    """Noise has the standard deviation asked for and does not repeat over frames and copies."""
    parameters = revise(SineParameters(), {"dimension": 2, "observation_noise_sd": 0.1})
    source = SignalSource(3, parameters)
    frames = [source.frame(t, History(((0, parameters),))) for t in range(4000)]
    noise = np.array([frame.signal - frame.target.position for frame in frames])
    assert np.allclose(noise.std(axis=0), 0.1, rtol=0.05)
    assert abs(np.corrcoef(noise.T)[0, 1]) < 0.06
    assert abs(np.corrcoef(noise[1:, 0], noise[:-1, 0])[0, 1]) < 0.06


def test_history_gives_what_was_in_force() -> None:
    """A history answers with the newest parameters at or before a frame, and how many steps each governed."""
    old, new = SineParameters(), revise(SineParameters(), {"observation_noise_sd": 1.0})
    history = History(((0, old), (5, new)))
    assert history.at(4) is old
    assert history.at(5) is new
    assert history.spans(3) == [(3, old)]
    assert history.spans(7) == [(4, old), (3, new)]
    assert history.spans(0) == []


def test_spans_in_which_what_matters_is_alike_are_one() -> None:
    """What adds up over them is then the same whether another parameter was changed in between or not."""
    slow, still, other = (
        revise(SineParameters(), {"observation_noise_sd": sd, "sample_count": count})
        for sd, count in ((0.1, 50), (0.1, 60), (0.2, 60))
    )
    history = History(((0, slow), (4, still), (6, other)))
    assert history.spans(7, "observation_noise_sd") == [(5, slow), (2, other)]
    assert history.spans(7, "waveform", "dimension") == [(7, slow)]
    assert history.spans(7) == [(3, slow), (2, still), (2, other)]
    with pytest.raises(IndexError):
        history.at(-1)
