// Served by the dashboard, the site leads back to it; opened from a file it does not know of any.
const at = location.pathname.indexOf("/help/");
if (at >= 0 && location.protocol.startsWith("http")) {
  const link = document.createElement("a");
  link.href = location.pathname.slice(0, at + 1);
  link.className = "back";
  link.textContent = "Dashboard";
  document.querySelector(".sidebar-brand")?.after(link);
}
