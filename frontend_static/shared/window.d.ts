/** What scripts that are not modules put into the page's window, and the scene's page into its own. */
interface Window {
  pftrackScene?: { drawn(): null | "there" | "in place"; frame(): number | null };
}
