// Panels of the side fold up by their titles; the folded ones are remembered over a reload.
import { byId } from "../base/dom.js";

const KEPT = "folded";
const FOLDED_FIRST = ["outputs-title", "set-title"];

function folded() {
  return new Set(JSON.parse(localStorage.getItem(KEPT) ?? "null") ?? FOLDED_FIRST);
}

function fold(title, isFolded) {
  title.closest(".panel").classList.toggle("folded", isFolded);
  title.querySelector("button").setAttribute("aria-expanded", String(!isFolded));
}

function toggle(title) {
  const all = folded();
  const isFolded = !all.has(title.id);
  all[isFolded ? "add" : "delete"](title.id);
  localStorage.setItem(KEPT, JSON.stringify([...all]));
  fold(title, isFolded);
}

/** Make the titles of the panels buttons. */
export function startPanels() {
  byId("live-panels").addEventListener("click", (event) => {
    const shown = document.body.classList.toggle("live-shown");
    event.currentTarget.setAttribute("aria-expanded", String(shown));
  });
  for (const title of byId("side").querySelectorAll(".panel > header h2")) {
    const button = document.createElement("button");
    button.type = "button";
    button.className = "fold";
    button.id = `${title.id}-fold`;
    button.append(...title.childNodes);
    button.addEventListener("click", () => toggle(title));
    title.append(button);
    fold(title, folded().has(title.id));
  }
}

/** Put the panels of an open take first; the style sheet hides those of the live stage. `open`: whether one is. */
export function arrangePanels(open) {
  const [solve, takes] = [byId("solve-panel"), byId("takes-panel")];
  const now = solve.compareDocumentPosition(takes) & Node.DOCUMENT_POSITION_FOLLOWING;
  if (open === Boolean(now)) return;
  if (open) byId("open-take-panel").after(solve);
  else takes.after(solve);
  byId("side").scrollTop = 0;
}

/** Unfold the panel of a title and scroll to it; on a phone, where the page itself would scroll, the stage stays. */
export function showPanel(titleId) {
  const title = byId(titleId);
  fold(title, false);
  const side = byId("side");
  const panel = title.closest(".panel");
  const top = side.scrollTop + panel.getBoundingClientRect().top - side.getBoundingClientRect().top;
  side.scrollTo({ top, behavior: "smooth" });
}
