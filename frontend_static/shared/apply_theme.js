// Runs before the first paint, so that nobody who chose dark is blinded by a white page.
try {
  const theme = localStorage.getItem("pftrack-theme");
  if (theme === "light" || theme === "dark") document.documentElement.dataset.theme = theme;
} catch {
  // No storage: the system decides.
}
