// Light or dark, set before the first picture: the choice kept in this browser, else the system's setting. A page in
// another language than its English template waits for its words (`strings.js`) instead of changing visibly.
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
