"""A class: a lecturer with two followers, each in a browser of their own, and what each of them sees and may do."""

from collections.abc import Callable
from typing import Any

import pytest
from playwright.sync_api import Page

from tests.browser.accessible import check, fits
from tests.browser.class_room import PHONE, WIDE, Follower, Lecturer, all_of
from tests.browser.conftest import Complaints
from tests.browser.host import Server
from tests.browser.views import SessionPage


@pytest.mark.timeout(600)  # four pages, one after the other
def test_a_lecturer_and_two_followers(
    watch: Callable[..., SessionPage], server: Server, newcomer: Callable[..., Follower], complaints: Complaints
) -> None:
    """Two see what the lecturer shows, answer, try it themselves, go along to other pages, and are sent home."""
    lecturer = Lecturer(watch().page, server)
    link = lecturer.lead()
    complaints.expected = ("/nowhere", "410 (Gone)", "response code: 403", f"{link}0")
    lecturer.sees_the_code()
    assert "Only this machine" in lecturer.page.inner_text("[data-role=reach]")
    check(lecturer.page)
    lecturer.press("Escape")
    followers = [newcomer(size) for size in (PHONE, WIDE)]
    for follower in followers:
        follower.open(link)
    lecturer.counts("2 follow")

    # The same frame and the same parameters; followers steer nothing.
    first, second = followers
    lecturer.press("ArrowRight")
    lecturer.stands_at(1)
    all_of(followers, lambda one: one.frame == "1", "frame 1 is painted")
    first.until(lambda: first.page.locator(".plots .figure-panel").count() > 2, "there is a place for each plot")
    assert first.page.locator("button:visible").all_inner_texts() == ["Try it yourself"]
    second.page.keyboard.press("ArrowRight")
    first.page.locator(".flat-canvas").click()
    first.page.keyboard.press("End")
    lecturer.change(sample_count=250)
    lecturer.press("ArrowRight")
    lecturer.stands_at(2)
    told = ((".in-force", "250 was 800"), (".following", "Following · frame 2 of 90"), (".readout", "250"))
    for place, words in told:
        all_of(followers, lambda one, place=place, words=words: words in one.text(place), f"{place} says {words}")  # type: ignore[misc]
    all_of(followers, lambda one: one.frame == "2", "frame 2 is painted")

    cut_off(lecturer, second)
    asked_and_answered(lecturer, followers)
    tried(lecturer, second, server)
    taken_along(lecturer, followers)
    shown_a_lesson(lecturer, followers)
    shown_a_failure(lecturer, followers)
    late = newcomer()
    shown_a_comparison(lecturer, followers, late, server)
    late.page.goto(server.get("follows")[0]["owner_link"])
    late.until(lambda: late.text(".follow-chip") == "2 follow", "the lecturer's other device leads")

    lecturer.page.locator(".follow-chip").click()
    lecturer.sees_the_code()  # which nobody gets once the class has ended
    lecturer.page.get_by_role("button", name="End", exact=True).click()
    lecturer.page.get_by_role("button", name="End for all").click()
    all_of(followers, lambda one: "The lecturer has ended this class" in one.text("main"), "the class has ended")
    lecturer.counts("Follow me")
    late.until(lambda: late.page.locator(".follow-chip").is_disabled(), "a link is worth nothing after its class")
    second.page.reload()
    assert "over" in second.text("main")


def cut_off(lecturer: Lecturer, follower: Follower) -> None:
    """One who is cut off keeps the picture, and is back where the lecturer is."""
    follower.page.evaluate("cutOff(true)")
    follower.until(lambda: follower.text(".following") == "Reconnecting", "the page says that it reconnects")
    lecturer.counts("1 follows")
    assert follower.frame == "2"
    follower.page.evaluate("cutOff(false)")
    lecturer.press("ArrowRight")
    follower.until(lambda: follower.frame == "3", "the one who was cut off sees frame 3")
    lecturer.counts("2 follow")


def asked_and_answered(lecturer: Lecturer, followers: list[Follower]) -> None:
    """A poll leaves the picture in sight, is answered by click and key, and shown to all when it is revealed."""
    first, second = followers
    lecturer.page.locator(".follow-chip").click()
    lecturer.page.get_by_label("Question").fill("Will it survive the pillar?")
    lecturer.page.get_by_role("button", name="Ask the class").click()
    all_of(followers, lambda one: one.page.locator(".poll-answer").count() == 2, "the question is there")
    fits(first.page)
    first.page.get_by_role("button", name="Yes").click()
    first.until(lambda: "You answered “Yes”" in first.text(".poll"), "the answer is taken")
    first.page.get_by_role("button", name="No").click()
    second.page.keyboard.press("2")
    lecturer.until(lambda: "2 of 2 have answered" in lecturer.page.inner_text(".lead-poll"), "all have answered")
    first.until(lambda: "You answered “No”" in first.text(".poll"), "the other answer is taken in its place")
    check(first.page)
    assert lecturer.page.locator(".lead-poll button.poll-answer").count() == 0, "it has no buttons"
    lecturer.press("2")
    assert lecturer.page.locator(".poll-bar").count() == first.page.locator(".poll-bar").count() == 0
    lecturer.page.get_by_role("button", name="Fold", exact=True).click()
    lecturer.until(lambda: lecturer.page.locator(".lead-poll .poll-answer:visible").count() == 0, "it is folded")

    lecturer.page.evaluate("Element.prototype.requestFullscreen = null")  # a full screen cannot be made larger
    lecturer.press("f")
    lecturer.page.get_by_role("button", name="Reveal").click()
    bars = lecturer.page.locator(".lead-poll .poll-bar:visible")
    lecturer.until(lambda: bars.count() == 2, "the bars are unfolded")
    frame = lecturer.position
    lecturer.press("ArrowRight")
    lecturer.until(lambda: bars.count() == 0, "it is in its place again")
    assert lecturer.position == frame, "the key does nothing else"
    lecturer.press("f")
    said = "Most answered “No”, 2 of 2; “Yes” 0."
    all_of(followers, lambda one: said in one.text(".poll"), "what was answered is told in words")
    lecturer.until(lambda: said in lecturer.page.inner_text(".lead-poll"), "the lecturer's page says so, too")
    counts = second.page.locator(".poll-count").all_inner_texts()
    assert [" ".join(count.split()) for count in counts] == ["0 · 0 %", "2 · 100 %"]
    assert "No · your answer" in first.text(".poll")
    lecturer.page.locator(".lead-poll").get_by_role("button", name="Close").click()
    all_of(followers, lambda one: one.page.locator(".poll").is_hidden(), "the poll is gone")


def taken_along(lecturer: Lecturer, followers: list[Follower]) -> None:
    """A preset is another session, to which the class comes along."""
    lecturer.choose_preset()
    lecturer.press(" ")
    lecturer.until(lambda: not lecturer.session["playing"], "it pauses")
    lecturer.counts("2 follow")
    all_of(followers, lambda one: one.frame == str(lecturer.position), "the class sees the other session's frame")
    lecturer.session_id = lecturer.id


def tried(lecturer: Lecturer, follower: Follower, server: Server) -> None:
    """A follower's own session begins at the lecturer's frame, goes its own way, and gives its place back."""
    follower.page.get_by_role("button", name="Try it yourself").click()
    own = SessionPage(follower.page, server).ready()
    assert own.id != lecturer.session_id
    own.stands_at(3)
    own.press("ArrowRight")
    own.stands_at(4)
    assert lecturer.position == 3
    tools = follower.page.locator("header button:visible, header a:visible").all_inner_texts()
    assert not {"Save", "Share", "Follow me", "pftrack"} & set(tools)
    lecturer.page.locator(".follow-chip").click()
    lecturer.until(lambda: "1 own copy" in lecturer.page.inner_text("[data-role=class-count]"), "one tries it")
    lecturer.press("Escape")
    assert follower.page.get_by_role("link", name="Back to the class").is_visible()
    own.menu("close")
    tries = follower.page.get_by_role("button", name="Try it yourself")
    follower.until(tries.is_enabled, "the place is free")


def shows_another(lecturer: Lecturer, address: str) -> Page:
    """Open another page, which the class sees once it is shown to it; return it."""
    page = lecturer.page
    page.goto(address)
    lecturer.counts("2 see another page")
    page.locator(".follow-chip").click()
    page.get_by_role("button", name="Show this page").click()
    page.locator("[data-role=class-link]").wait_for()
    lecturer.press("Escape")
    return page


def shown_a_lesson(lecturer: Lecturer, followers: list[Follower]) -> None:
    """The class goes with its lecturer to another page, and sees a lesson's figure with what is moved."""
    page = shows_another(lecturer, "learn/9")
    all_of(followers, lambda one: one.page.locator(".figure-view[data-shown]").count() == 1, "the figure is there")
    all_of(followers, lambda one: "400" in one.text(".in-force"), "the number of particles is listed")
    page.locator(".lesson-question").get_by_role("button", name="Skip").click()
    page.locator(".lesson-fields:enabled").wait_for()
    slider = page.locator(".lesson-controls input[type=range]").first
    slider.press("ArrowRight")
    lecturer.until(lambda: slider.input_value() != "400", "there are more particles")
    moved, number = f"{slider.input_value()} was 400", ".lesson-number.first output"
    all_of(followers, lambda one: moved in one.text(".in-force"), "what was moved is listed")
    all_of(followers, lambda one: one.text(number) == page.inner_text(number), "the number that counts is the same")

    follower = followers[0]
    follower.page.get_by_role("button", name="Try it yourself").click()
    follower.page.wait_for_url("**/learn/*")
    follower.page.locator(".figure-view[data-shown]").wait_for()
    assert follower.page.locator("header a:visible").all_inner_texts() == ["Back to the class"]
    follower.page.get_by_title("End your copy").click()
    follower.page.locator(".following[data-state=open]").wait_for()


def shown_a_failure(lecturer: Lecturer, followers: list[Follower]) -> None:
    """A failure is seen beside its cure, with what the cure changes, and the class comes along to the next one."""
    page = shows_another(lecturer, "failures/4")
    for frame in ("6", "7"):
        painted = f".flat-canvas[data-frame='{frame}']"
        all_of(followers, lambda one, it=painted: one.page.locator(it).count() == 2, f"both stand at frame {frame}")
        lecturer.press("ArrowRight")
    first = followers[0]
    assert first.page.locator(".compared-head h2").all_inner_texts() == ["1\nFails", "2\nCured"]
    assert "Condensation" in first.text(".comparison-table")
    assert first.page.locator(".transport").count() == 0
    fits(first.page)
    onward = page.get_by_role("link", name="Next failure")
    title = onward.get_attribute("title").removeprefix("Next failure, ")
    onward.click()
    lecturer.counts("2 follow")
    all_of(followers, lambda one: one.text("h1") == title, "the class sees the next failure")


def compared(outcome: dict[str, Any] | None, arrangement: str) -> dict[str, Any]:
    """What the page of a comparison tells of two runs."""
    runs = [
        {"name": name, "title": name, "colour": colour, "first": 0}
        for name, colour in (("h-SPF", "#0072b2"), ("Condensation", "#009e73"))
    ]
    settings = [{"name": "tracker", "title": "Tracker", "values": [run["name"] for run in runs]}]
    outline = {"unit": "px", "settings": settings, "runs": runs}
    return {"comparison": {"outline": outline, "outcome": outcome, "arrangement": arrangement}}


def shown_a_comparison(lecturer: Lecturer, followers: list[Follower], late: Follower, server: Server) -> None:
    """Two runs stand side by side; a follower who comes when the class is full waits; a forged link leads nowhere."""
    first = followers[0]
    [follow] = server.get("follows")
    sessions = [lecturer.session_id, server.start_session(tracker="condensation")["id"]]
    shown = {"sessions": sessions, "lesson": None, "arrangement": compared(None, "side")}
    server.patch(f"follows/{follow['id']}", shown)
    pictures = ".flat-canvas[data-frame]"
    all_of(followers, lambda one: one.page.locator(pictures).count() == 2, "both sessions are there")
    all_of(followers, lambda one: "Condensation" in one.text(".comparison-table"), "what differs is listed")
    assert first.page.locator(".transport").count() == 0
    fits(first.page)
    failed = {"state": "failed", "done": 0, "total": 0, "result": None, "error": "It was in vain."}
    first.page.evaluate("window.picture = document.querySelector('.flat-canvas')")
    server.patch(f"follows/{follow['id']}", {"arrangement": compared(failed, "over")})
    all_of(followers, lambda one: "It was in vain." in one.text(".comparison-table"), "what came of them is told")
    assert first.page.evaluate("picture === document.querySelector('.flat-canvas')"), "it is the same page"
    first.until(lambda: first.page.evaluate("picture.offsetWidth") > PHONE[0] / 2, "the one picture has the room")
    lecturer.counts("2 follow")
    server.patch(f"follows/{follow['id']}", {"most_followers": 2})
    late.page.goto(first.page.url)
    late.until(lambda: "This class is full" in late.text("main"), "there is no place for one more")
    server.patch(f"follows/{follow['id']}", {"most_followers": 3})
    late.until(lambda: late.page.locator(pictures).count() == 2, "it came in by itself")
    lecturer.counts("3 follow")
    late.page.goto(f"{first.page.url.removesuffix('/')}0")
    assert "not made by this server" in late.text("main")
