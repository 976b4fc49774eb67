// The mannequin's body that this browser shows. The part inside the view is `view_body.js`, which follows the choice.
import { byId, h } from "../base/dom.js";
import { canOperate } from "../base/role.js";
import { number, t } from "../base/strings.js";
import { openRobot } from "../robots/robots.js";

const KEPT = "body";

/** Bodies to choose from, the default first. */
export const BODIES = ["standard", "slim", "blocks"];

/** The body that this browser shows. */
export const shownBody = () => (BODIES.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : BODIES[0]);

function chip(id, words, hint, pressed, onclick) {
  return h("button", { type: "button", id, class: "chip-button", title: hint, onclick, aria: { pressed: String(pressed) } }, words);
}

/**
 * Return the choice of a character for the menu of layers: a body, in this browser, or a robot, in all browsers.
 * `changed` is called after another body was chosen; `change` changes the view.
 */
export function bodyChoice({ robots, robot, robot_strained: strained, robot_gave_way: times }, changed, change) {
  const choose = (name) => {
    localStorage.setItem(KEPT, name);
    changed();
    if (robot) change({ robot: "" });
  };
  const choice = h("div", { class: "points-choice", role: "group", aria: { label: t("body.group") } }, [
    ...BODIES.map((name) => chip(`body-${name}`, t(`body.${name}`), t(`body.${name}_hint`), !robot && name === shownBody(), () => choose(name))),
    ...robots.map((name) => chip(`robot-${name}`, name, t("body.robot_hint"), name === robot, () => change({ robot: name }))),
    ...(canOperate() ? robotButtons(robot, change) : []),
  ]);
  const told = [
    strained.length && robotTable("strain", ["joint", "frames", "most", "at"], strained, ({ joint, frame_share: share, most, at_s: at }) => [joint, [100 * share, 1], [most, 2], [at, 2]]),
    times.length && robotTable("gave_way", ["point", "from", "to", "cm"], times, ({ point, begin_s: begin, end_s: end, most_m: most }) => [point, [begin, 2], [end, 2], [100 * most, 0]]),
  ].filter(Boolean);
  return told.length ? h("div", {}, [choice, ...told]) : choice;
}

/** Return the buttons for robots: open the shown one, add another one. */
function robotButtons(robot, change) {
  const button = (id, key, onclick) => h("button", { type: "button", id, class: "chip-button", title: t(`robot.${key}_hint`), onclick }, t(`robot.${key}`));
  return [
    robot && button("robot-open", "open", () => openRobot(robot, (name) => change({ robot: name }))),
    button("robot-add", "add", () => byId("import-open").click()),
  ].filter(Boolean);
}

/**
 * Return a table about the replayed motion of a robot: which joints need more torque than their limits ("strain"), or
 * when it gave way for that ("gave_way"). `cells` returns a row's name, and its numbers with their digits.
 */
function robotTable(what, columns, rows, cells) {
  const several = new Set(rows.map((one) => one.performer)).size > 1;
  const row = (one) => {
    const [name, ...values] = cells(one);
    return h("tr", {}, [
      h("th", { scope: "row" }, several ? `${one.performer}: ${name}` : name),
      ...values.map(([value, digits]) => h("td", {}, number(value, digits))),
    ]);
  };
  return h("div", { id: `robot-${what}`, class: "robot-strain", title: t(`body.${what}_hint`) }, h("table", {}, [
    h("caption", {}, t(`body.${what}`)),
    h("thead", {}, h("tr", {}, columns.map((key) => h("th", { scope: "col" }, t(`body.${what}.${key}`))))),
    h("tbody", {}, rows.map(row)),
  ]));
}
