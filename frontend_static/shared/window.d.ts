/** What scripts that are not modules put into the page's window, and the scene's page into its own. */
interface Window {
  pftrackScene?: { drawn(): null | "there" | "in place"; frame(): number | null };
}

/** What TypeScript does not know yet of keyboards; not all browsers have it. */
interface Navigator {
  readonly keyboard?: { getLayoutMap(): Promise<ReadonlyMap<string, string>> };
}
