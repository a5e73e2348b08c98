// Before the first paint: the colours that were chosen here, or those of the dashboard, or the system's.
try {
  document.body.dataset.theme = localStorage.getItem("theme") || localStorage.getItem("pftrack-theme") || "auto";
} catch {
  document.body.dataset.theme = "auto";
}
