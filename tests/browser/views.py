"""The pages as a person sees and uses them."""

from collections.abc import Callable
from typing import Any, Self, TypeAlias

from tests.browser.host import Server
from tests.waiting import wait_for

PARTICLES = """(() => {
    let count = 0;
    window.__viserMutable?.nodeRefFromName['/particles']?.traverse((item) => {
        if (item.isPoints) count = item.geometry.attributes.position.count;
    });
    return count;
})()"""

# A question about the pixels of the scene's picture, four numbers each, row after row.
IN_PICTURE = """(() => {
    let answer = 0;
    window.__viserMutable?.nodeRefFromName['/picture']?.traverse((item) => {
        const image = item.isMesh && item.material.map?.image;
        if (!image || !image.width) return;
        const context = new OffscreenCanvas(image.width, image.height).getContext('2d');
        context.drawImage(image, 0, 0);
        const { data } = context.getImageData(0, 0, image.width, image.height);
        const row = data.subarray(20 * image.width, 24 * image.width);
        answer = QUESTION;
    });
    return answer;
})()"""
# Whether the ball's red is somewhere.
BALL = IN_PICTURE.replace(
    "QUESTION", "data.some((red, i) => i % 4 === 0 && red > 150 && data[i + 1] < 90 && data[i + 2] < 90)"
)

# The frames on all flat canvases of a page that have one.
PAINTED_FRAMES = "[...document.querySelectorAll('.flat-canvas[data-frame]')].map((it) => Number(it.dataset.frame))"

# The traces of the plots; their numbers of points by name; and one of them by its name.
TRACES = """[...document.querySelectorAll('.plots .figure-view')].flatMap(({ figure }) => figure?.panels ?? [])
    .flatMap(({ traces }) => traces)"""
LINES = f"Object.fromEntries({TRACES}.map(({{ name, x, links }}) => [name, (x ?? links ?? []).length]))"
TRACE = f"""(name) => {{
    const found = {TRACES}.find((one) => one.name === name && (one.x ?? one.links ?? one.intervals).length > 0);
    return found ? {{ ...found }} : null;
}}"""

# Where values lie in a plot.
PLACE = """([plot, x, y]) => {
    const { panels } = document.querySelector('.plots .figure-view').figure;
    const panel = panels.find(({ id }) => id === plot);
    const { dataset } = document.querySelector(`.plots [data-panel="${plot}"] .figure-plot`);
    const [left, top, width, height] = ['left', 'top', 'width', 'height'].map((name) => Number(dataset[name]));
    return {
        x: left + (x - panel.x.low) / (panel.x.high - panel.x.low) * width,
        y: top + (panel.y.high - y) / (panel.y.high - panel.y.low) * height,
    };
}"""


Place: TypeAlias = tuple[float, float]


class View:
    """A page with a way to await what it shows."""

    def __init__(self, page: Any) -> None:
        self.page = page

    @property
    def id(self) -> str:
        """What the address ends with."""
        return str(self.page.url.split("?")[0].rsplit("/", 1)[1])

    def resize(self, width: int, height: int = 800) -> None:
        self.page.set_viewport_size({"width": width, "height": height})
        self.until(lambda: self.page.evaluate("innerWidth") == width, f"the window is {width} px wide")

    def drag(self, start: Place, *places: Place, steps: int = 4) -> None:
        """Press the mouse at a place of the window, px, move it to others, and let it go there."""
        self.page.mouse.move(*start)
        self.page.mouse.down()
        for place in places:
            self.page.mouse.move(*place, steps=steps)
        self.page.mouse.up()

    def until(self, holds: Callable[[], object], what: str, seconds: float = 120.0) -> None:
        """Ask again and again, while the page continues, until something holds."""
        wait_for(holds, seconds, what, lambda rest: self.page.wait_for_timeout(1000 * rest))


class Gallery(View):
    """The start page."""

    def card(self, experiment: str) -> Any:
        return self.page.locator(f"[data-experiment={experiment}]")

    def preset(self, experiment: str, name: str) -> None:
        """Open a preset, unfolding its card where it is not among the first."""
        link = self.card(experiment).locator(f"[data-preset={name}]")
        link.wait_for(state="attached")
        if not link.is_visible():
            self.card(experiment).locator("summary").click()
        link.click()

    def has_picture(self, mark: str = "") -> None:
        """Wait for the picture in which a target is marked."""
        image = f"document.querySelector('{mark} .mark-surface img')"
        self.until(lambda: self.page.evaluate(f"{image}?.complete"), "the picture is there")

    def choose(self, name: str, content: bytes, mime: str) -> None:
        """Choose a file in the drop zone."""
        self.page.set_input_files("#file-picker", {"name": name, "mimeType": mime, "buffer": content})


class SessionPage(View):
    """The page of a session."""

    def __init__(self, page: Any, server: Server) -> None:
        super().__init__(page)
        self._server = server

    @property
    def session(self) -> dict[str, Any]:
        return self._server.session(self.id)

    def ready(self) -> Self:
        """Wait until the page is connected and shows a frame, by particles in the scene or on the flat canvas."""
        self.page.wait_for_url("**/session/*", wait_until="commit")
        self.until(lambda: self.position is not None, "the frame counter shows a number")
        self.until(lambda: self.page.locator(".play").is_enabled(), "the play button can be pressed")
        self.until(lambda: self.painted is not None or self.in_scene(PARTICLES, 0) > 0, "there is a frame to see")
        return self

    # ------------------------------------------------------------ what is shown

    @property
    def position(self) -> int | None:
        """The frame that the counter names."""
        words = self.page.inner_text(".counter").split()
        return int(words[1]) if len(words) > 1 else None

    @property
    def verdict(self) -> str:
        return str(self.page.inner_text(".verdict"))

    @property
    def scene(self) -> Any:
        return next((frame for frame in self.page.frames if "/viz/" in frame.url), None)

    def in_scene(self, expression: str, otherwise: Any) -> Any:
        """Evaluate in the scene's frame, which may still be loading."""
        from playwright.sync_api import Error

        frame = self.scene
        try:
            return frame.evaluate(expression) if frame else otherwise
        except Error:
            return otherwise

    @property
    def particles(self) -> int:
        return int(self.in_scene(PARTICLES, 0))

    @property
    def lines(self) -> dict[str, int]:
        return self.page.evaluate(LINES)

    def trace(self, name: str) -> dict[str, Any] | None:
        """Return a trace of the plots; None while it is not there."""
        return self.page.evaluate(TRACE, name)

    def place_in(self, plot: str, x: float, y: float) -> dict[str, float]:
        """Return where values lie in a plot, px of its `.figure-plot`."""
        return self.page.evaluate(PLACE, [plot, x, y])

    def plot(self, name: str) -> Any:
        """Return a plot with its title."""
        return self.page.locator(f".plots [data-panel='{name}']")

    @property
    def plots(self) -> list[str]:
        """Names of the plots that are there."""
        return [it.get_attribute("data-panel") for it in self.page.locator(".plots .figure-panel").all()]

    def stands_at(self, frame: int) -> None:
        self.until(lambda: self.position == frame, f"the page stands at frame {frame}")

    @property
    def painted(self) -> int | None:
        """The frame on the canvas of the flat view."""
        frames: list[int] = self.page.evaluate(PAINTED_FRAMES)
        return frames[0] if frames else None

    def paints(self, frame: int) -> None:
        self.until(lambda: self.painted == frame, f"frame {frame} is painted")

    def control(self, label: str, kind: str = "number") -> Any:
        """Return a parameter's control in the flat view: its box, or its slider."""
        return self.page.get_by_label(label, exact=True).and_(self.page.locator(f"[type={kind}]"))

    # ------------------------------------------------------------ what can be done

    def command(self, kind: str, **more: Any) -> None:
        """Send a command from elsewhere."""
        self._server.post(f"sessions/{self.id}/commands", {"kind": kind, **more})

    def change(self, **values: Any) -> None:
        """Change parameters from elsewhere."""
        self.command("change", values=values)

    def go_to(self, frame: int) -> None:
        """Have the server go to a frame, and wait until the page is there."""
        self._server.seek(self.id, frame)
        self.stands_at(frame)

    def menu(self, tool: str) -> None:
        """Choose something from the menu."""
        self.page.get_by_role("button", name="Menu", exact=True).click()
        self.page.locator(f"[data-tool={tool}]").click()
        if tool in {"files", "rename", "share"}:
            self.page.locator("dialog[open]").wait_for()

    def press(self, key: str) -> None:
        self.page.keyboard.press(key)

    def play_to_the_end(self) -> None:
        """Play to the end as fast as possible."""
        last = self.session["frames"] - 1
        self.page.locator("select[aria-label=Speed]").select_option("0")
        self.until(lambda: self.session["speed"] == 0, "the speed is the highest")
        if not self.session["playing"] and self.session["position"] < last:
            self.page.click(".play")
        self.stands_at(last)

    def choose_preset(self) -> None:
        """Open the last preset of the menu, which is another session."""
        before = self.id
        self.page.locator(".top [aria-label=Presets]").press("p")
        self.page.locator("[data-preset]").last.click()
        self.until(lambda: self.id not in {before, "new"}, "another session is open")
        self.ready()

    def branch(self, tracker: str) -> None:
        """Continue from here with another tracker."""
        branches = len(self.session["branches"])
        self.press("n")
        self.page.select_option("#branch-tracker", tracker)
        self.page.click("text=Branch here")
        self.page.locator(".branches .chip").nth(branches).wait_for(state="attached")  # so the page has been told, too
        self.page.locator("dialog").wait_for(state="detached")
