// Light or dark, before the first picture: the choice kept in this browser, else what the system asks for.
(() => {
  const system = matchMedia("(prefers-color-scheme: light)");
  const show = () => {
    const kept = localStorage.getItem("theme");
    document.documentElement.dataset.theme = kept === "light" || kept === "dark" ? kept : system.matches ? "light" : "dark";
  };
  system.addEventListener("change", show);
  addEventListener("storage", show);
  show();
})();
