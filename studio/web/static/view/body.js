// Which of the mannequin's bodies this browser shows. The view's own part is `view_body.js`, which hears of another choice.
import { h } from "../base/dom.js";
import { number, t } from "../base/strings.js";

const KEPT = "body";

/** Bodies to choose from, the usual one first. */
export const BODIES = ["standard", "slim", "blocks"];

/** The body that this browser shows. */
export const shownBody = () => (BODIES.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : BODIES[0]);

function chip(id, words, hint, pressed, onclick) {
  return h("button", { type: "button", id, class: "chip-button", title: hint, onclick, aria: { pressed: String(pressed) } }, words);
}

/**
 * Return the choice of a character, for the menu of layers: a body, in this browser, or a robot, in all of them.
 * `changed` is called after another body was chosen; `change` changes the view.
 */
export function bodyChoice({ robots, robot, robot_strained: strained }, changed, change) {
  const choose = (name) => {
    localStorage.setItem(KEPT, name);
    changed();
    if (robot) change({ robot: "" });
  };
  const choice = h("div", { class: "points-choice", role: "group", aria: { label: t("body.group") } }, [
    ...BODIES.map((name) => chip(`body-${name}`, t(`body.${name}`), t(`body.${name}_hint`), !robot && name === shownBody(), () => choose(name))),
    ...robots.map((name) => chip(`robot-${name}`, name, t("body.robot_hint"), name === robot, () => change({ robot: name }))),
  ]);
  return strained.length ? h("div", {}, [choice, strainOf(strained)]) : choice;
}

/** Of which joints the replayed motion asks more torque than their limits, when, and how far beyond. */
function strainOf(strained) {
  const told = ({ joint, frame_share: share, most, at_s: at }) => t("body.strained", { joint, percent: number(100 * share, 1), most: number(most, 1), at: number(at, 2) });
  return h("div", { id: "robot-strain", class: "robot-strain", title: t("body.strain_hint") }, [
    h("p", {}, t("body.strain")), h("ul", {}, strained.map((one) => h("li", {}, told(one)))),
  ]);
}
