/** Globals that non-module scripts set in the page's window, and the scene's page in its own. */
interface Window {
  pftrackScene?: { drawn(): null | "there" | "in place"; frame(): number | null };
}

/** Keyboard functions that TypeScript does not know yet; not all browsers have them. */
interface Navigator {
  readonly keyboard?: { getLayoutMap(): Promise<ReadonlyMap<string, string>> };
}
