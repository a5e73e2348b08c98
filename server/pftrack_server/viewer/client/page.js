// Appearance and behaviour of the scene within the outer page.

// Light or dark: as the outer page chooses (?theme=), or else as the system does. viser reads ?darkMode once, at start.
// A ?websocket= is dropped: the scene talks to its own session only. ?panel=none leaves the panel out.
const address = new URLSearchParams(location.search);
const asked = address.get("theme");
const bare = address.get("panel") === "none" ? ["panel=none"] : [];
const system = matchMedia("(prefers-color-scheme: dark)");
const usual = system.matches ? "dark" : "light";
const theme = asked === "light" || asked === "dark" ? asked : usual;
const query = [...(asked ? [`theme=${theme}`] : []), ...(theme === "dark" ? ["darkMode=1"] : []), ...bare];
history.replaceState(null, "", location.pathname + (query.length ? `?${query.join("&")}` : ""));
document.documentElement.dataset.theme = theme;
if (bare.length > 0) document.documentElement.dataset.panel = "none";
const restart = (/** @type {"light"|"dark"} */ wanted) => {
  if (wanted !== theme) location.replace(`${location.pathname}?${[`theme=${wanted}`, ...bare].join("&")}`);
};
if (!asked) system.addEventListener("change", () => location.reload());
addEventListener("message", (event) => {
  if (event.origin === location.origin && event.data?.source === "pftrack" && event.data.theme) {
    restart(event.data.theme === "dark" ? "dark" : "light");
  }
});

// viser loads a sorter for Gaussian splats that evaluates text, which the policy forbids; nothing here draws splats.
addEventListener("unhandledrejection", (event) => event.reason instanceof EvalError && event.preventDefault());

// Reconnect while visible. viser retries only in a focused window, which an iframe rarely is.
document.hasFocus = () => document.visibilityState === "visible";
document.addEventListener("visibilitychange", () => {
  dispatchEvent(new Event(document.visibilityState === "visible" ? "focus" : "blur"));
});
