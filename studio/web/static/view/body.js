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

/** Of which joints the replayed motion asks more torque than their limits, how often, how far beyond, and when. */
function strainOf(strained) {
  const several = new Set(strained.map((one) => one.performer)).size > 1;
  const row = ({ performer, joint, frame_share: share, most, at_s: at }) => h("tr", {}, [
    h("th", { scope: "row" }, several ? `${performer}: ${joint}` : joint),
    ...[[100 * share, 1], [most, 2], [at, 2]].map(([value, digits]) => h("td", {}, number(value, digits))),
  ]);
  return h("div", { id: "robot-strain", class: "robot-strain", title: t("body.strain_hint") }, h("table", {}, [
    h("caption", {}, t("body.strain")),
    h("thead", {}, h("tr", {}, ["joint", "frames", "most", "at"].map((key) => h("th", { scope: "col" }, t(`body.strain.${key}`))))),
    h("tbody", {}, strained.map(row)),
  ]));
}
