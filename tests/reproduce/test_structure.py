"""The figures of the shape of prism and face."""

from pftrack.reproduce.structure import Trial, draw, online, run_trial


def test_figures_are_drawn() -> None:
    """Figures 4.21 to 4.24 are those of the prism, 4.26 and 4.27 those of the face."""
    trial = Trial("prism", 0)
    courses, common, own = [run_trial(trial)], [online(trial, 0.5, "common")], [online(trial, 1.0, "by-information")]
    names = [draw(kind, courses, common, own) for kind in ("prism", "face")]
    found = [[name.split("-")[1] for name in each] for each in names]
    assert (found[0], set(found[1])) == (["4.21", "4.22", "4.23", "4.24"], {"4.26", "4.27"})
