// The search field for takes, and examples of what may be typed into it.
import { byId, h } from "../base/dom.js";
import { t } from "../base/strings.js";
import { foundTakes } from "./found.js";

const SETTLE_MS = 200; // what is being typed is looked for once it rests
const EXAMPLES = [
  ["punch anna", "words"], ["tag:best,fight", "tag"], ['performer:"Anna B"', "performer"], ["name:jump", "text"], ["date:>=2026-01", "date"],
  ["length:>10s", "length"], ["error:<20mm", "error"], ["jitter:<2mm", "figures"], ["rating:>=3", "rating"], ["is:starred", "is"], ["-tag:best", "not"],
];

let timer = 0;

function example([text, key], search) {
  return [h("dt", {}, h("button", { class: "chip-button", type: "button", onclick: () => { search(text); byId("takes-search").focus(); } }, text)),
    h("dd", {}, t(`search.${key}`))];
}

/** Start; `search` searches for a text, `all` selects what was found. */
export function startSearch({ search, all }) {
  const field = byId("takes-search");
  field.value = foundTakes().search;
  field.addEventListener("input", () => {
    clearTimeout(timer);
    timer = setTimeout(() => search(field.value), SETTLE_MS);
  });
  byId("takes-help").append(
    h("dl", { class: "search-examples" }, EXAMPLES.flatMap((one) => example(one, search))),
    h("p", { class: "muted" }, t("search.together")),
    h("button", { class: "small", type: "button", id: "takes-select-all", onclick: all }, t("selected.all")));
}
