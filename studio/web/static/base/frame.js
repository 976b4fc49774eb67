// The top bar of every operator's page: choice of language, and light or dark.
import { byId, h } from "./dom.js";
import { LANGUAGES, chooseLanguage, language, t } from "./strings.js";

function showTheme() {
  const dark = document.documentElement.dataset.theme !== "light";
  byId("theme").replaceChildren(h("span", { aria: { hidden: "true" } }, dark ? "☾" : "☀"));
  byId("theme").title = t(dark ? "top.to_light" : "top.to_dark");
}

function changeTheme() {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === "light" ? "dark" : "light";
  localStorage.setItem("theme", root.dataset.theme);
  showTheme();
}

/** Fill in and connect the controls of the top bar. */
export function startFrame() {
  byId("language").append(...Object.entries(LANGUAGES).map(([code, name]) =>
    h("option", { value: code, selected: code === language(), title: name, lang: code }, code.toUpperCase())));
  byId("language").addEventListener("change", (event) => chooseLanguage(event.currentTarget.value));
  byId("theme").addEventListener("click", changeTheme);
  new MutationObserver(showTheme).observe(document.documentElement, { attributeFilter: ["data-theme"] });
  showTheme();
}
