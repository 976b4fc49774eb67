// Which of the mannequin's bodies this browser shows. The view's own part is `view_body.js`, which hears of another choice.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

const KEPT = "body";

/** Bodies to choose from, the usual one first. */
export const BODIES = ["standard", "slim", "blocks"];

/** The body that this browser shows. */
export const shownBody = () => (BODIES.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : BODIES[0]);

/** Return the choice of a body, for the menu of layers; `changed` is called after another choice. */
export function bodyChoice(changed) {
  const choose = (name) => {
    localStorage.setItem(KEPT, name);
    changed();
  };
  return h("div", { class: "points-choice", role: "group", aria: { label: t("body.group") } }, BODIES.map((name) => h("button", {
    type: "button", id: `body-${name}`, class: "chip-button", title: t(`body.${name}_hint`), onclick: () => choose(name), aria: { pressed: String(name === shownBody()) },
  }, t(`body.${name}`))));
}
