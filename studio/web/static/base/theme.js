// Light or dark, before the first picture: the choice kept in this browser, else what the system asks for. And a page
// whose words are not the English ones of its template waits for them (`strings.js`) instead of changing before one's eyes.
(() => {
  const system = matchMedia("(prefers-color-scheme: light)");
  const show = () => {
    const kept = localStorage.getItem("theme");
    document.documentElement.dataset.theme = kept === "light" || kept === "dark" ? kept : system.matches ? "light" : "dark";
  };
  system.addEventListener("change", show);
  addEventListener("storage", show);
  show();
  if (!(localStorage.getItem("language") ?? navigator.language).toLowerCase().startsWith("en")) document.documentElement.dataset.words = "coming";
})();
