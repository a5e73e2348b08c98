import cv2
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pftrack.vision.likelihoods import template
from tests.vision.refusing import refuse

SIZES = np.array([[64, 42], [36, 36], [24, 24], [7, 9]])
POINTS = np.array([[80.0, 60.0], [40.4, 50.6], [120.0, 90.0], [15.0, 15.0]])


NOISE = np.random.default_rng(0).uniform(0, 255, (120, 160)).astype(np.float32)
GREY = cv2.normalize(cv2.GaussianBlur(NOISE, (0, 0), 2), None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
TEMPLATES = template.cut(GREY, POINTS, SIZES)


def test_a_template_correlates_with_itself_as_1() -> None:
    """The NCC of a template with the patch that it was cut from is 1, and the likelihood greatest there.

    A picture of half the contrast and more light correlates as the original does.
    """
    assert np.allclose(template.correlations(GREY, POINTS[:, None], TEMPLATES), 1, atol=1e-5)
    assert np.allclose(template.log_likelihood(GREY, POINTS[:, None], TEMPLATES), 0, atol=1e-6)
    dimmer = (GREY * 0.5 + 60).astype(np.uint8)
    assert (template.correlations(dimmer, POINTS[:, None], TEMPLATES) > 0.999).all()


def test_a_template_is_like_itself_and_less_like_another() -> None:
    """The likeness of two sets is the NCC of each template with the other's; sets of other sizes are refused."""
    one, other = template.cut(GREY, POINTS, SIZES), template.cut(GREY, POINTS + 3, SIZES)
    assert np.allclose(template.likeness(one, one), 1, atol=1e-5)
    moved = template.correlations(GREY, POINTS[:, None] + 3, one)[:, 0]
    assert np.allclose(template.likeness(one, other), moved, atol=1e-4)
    refuse("same sizes", template.likeness, one, template.cut(GREY, POINTS[:2], SIZES[:2]))


def test_agrees_with_opencv() -> None:
    """At every particle the correlation is that of OpenCV's matchTemplate, and weighs as in eq. 4.11."""
    templates = template.cut(GREY, POINTS[:3], SIZES[:3])
    positions = POINTS[:3, None] + np.random.default_rng(1).normal(0, 4, (3, 40, 2))
    found = template.correlations(GREY, positions, templates)
    for f, (w, h) in enumerate(SIZES[:3]):
        left, top = np.floor(POINTS[f] + 0.5).astype(int) - (w // 2, h // 2)
        patch = GREY[top : top + h, left : left + w]
        everywhere = cv2.matchTemplate(GREY, patch, cv2.TM_CCOEFF_NORMED)
        columns, rows = (np.floor(positions[f] + 0.5).astype(int) - (w // 2, h // 2)).T
        assert np.allclose(found[f], everywhere[rows, columns], atol=1e-4)
    scores = template.log_likelihood(GREY, positions, templates)
    assert np.allclose(scores, -0.5 * ((1.0 - found) / 0.15) ** 2, atol=1e-6)


def test_outside_and_flat_count_as_least() -> None:
    """NCC is -1 where the patch reaches beyond the picture, where there is no contrast, and for a flat template."""
    templates = template.cut(GREY, POINTS[:1], SIZES[:1])
    outside = [[31.4, 60.0], [31.5, 60.0], [128.4, 60], [128.5, 60], [80, 20.4], [80, 99.5], [1e300, -1e300]]
    inside = template.correlations(GREY, np.array([outside]), templates) > -1
    assert inside.tolist() == [[False, True, True, False, False, False, False]]
    flat = np.full_like(GREY, 130)
    flat[::2, ::7] += 1
    assert (template.correlations(flat, POINTS[:1, None], templates) == -1).all()
    of_flat = template.cut(flat, POINTS[:1], SIZES[:1])
    assert not of_flat.pixels.any()
    assert (template.correlations(GREY, POINTS[:1, None], of_flat) == -1).all()


@given(st.lists(st.floats(allow_nan=True, allow_infinity=True), min_size=2, max_size=2))
def test_likelihood_is_always_finite(position: list[float]) -> None:
    """Whatever the position, the likelihood is a finite number and never NaN."""
    positions = np.full((len(POINTS), 1, 2), position)
    assert np.isfinite(template.log_likelihood(GREY, positions, TEMPLATES)).all()


def test_templates_at_the_edge_are_completed() -> None:
    """A point in the corner of the picture has a template; one beyond the picture is refused by name of both sides."""
    assert template.cut(GREY, np.array([[0.0, 0.0]]), SIZES[:1]).pixels.any()
    for beyond in ([-1.0, 5.0], [160.0, 5.0], [np.nan, 5.0]):
        refuse("within the picture of 160 x 120 px", template.cut, GREY, np.array([beyond]), SIZES[:1])
    refuse(r"points must be \(F, 2\) with F = 1", template.cut, GREY, POINTS, SIZES[:1])


def test_luma_of_grey_is_grey() -> None:
    """A grey picture keeps its levels, with one channel or three; colour is weighed 0.299, 0.587, 0.114."""
    for picture in (GREY, GREY[:, :, None], np.repeat(GREY[:, :, None], 3, axis=2)):
        assert np.array_equal(template.luma(picture), GREY)
    assert template.luma(np.full((1, 1, 3), (200, 100, 50), np.uint8)) == round(0.299 * 200 + 0.587 * 100 + 0.114 * 50)
    refuse("expected a picture", template.luma, np.zeros((2, 2, 2), np.uint8))


def test_renewal_follows_the_picture() -> None:
    """Renewed templates come closer to what is seen; at rate 0, or for a point out of sight, they stay."""
    other = cv2.flip(GREY, 1)
    before = template.correlations(other, POINTS[:, None], TEMPLATES)
    after = template.correlations(other, POINTS[:, None], template.renew(TEMPLATES, other, POINTS, 0.3))
    assert (after > before + 0.1).all()
    lost = POINTS.copy()
    lost[0] = np.nan
    kept = template.renew(TEMPLATES, other, lost, 1.0)
    assert np.array_equal(kept.pixels[: 64 * 42], TEMPLATES.pixels[: 64 * 42])
    assert np.allclose(template.renew(TEMPLATES, other, POINTS, 0.0).pixels, TEMPLATES.pixels, atol=1e-6)
