// Dialog of a kept robot: what it is, which of its bodies is which part, and its limits; it can be corrected or removed.
import { changeRobot, getRobot, removeRobot, restoreRobot } from "../base/api.js";
import { byId, h } from "../base/dom.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const RESTORE = undoing("robot", (name) => attempt(() => restoreRobot(name)));
const DEGREES = 180 / Math.PI;
const state = { name: "", facts: null, busy: "", changed: () => {} };

async function during(words, action) {
  state.busy = words;
  draw();
  const facts = await attempt(action);
  state.busy = "";
  if (facts) state.facts = facts;
  draw();
  return facts;
}

/** Show a kept robot; `changed` gets its name once it is corrected, and "" once it is removed. */
export async function openRobot(name, changed) {
  Object.assign(state, { name, facts: null, changed });
  byId("robot-dialog").showModal();
  if (!(await during(t("robot.reading", { name }), () => getRobot(name)))) byId("robot-dialog").close();
}

async function correct(change) {
  if (!(await during(t("robot.saving"), () => changeRobot(state.name, change)))) return;
  showNote(t("robot.saved", { name: state.name }));
  state.changed(state.name);
}

async function remove() {
  const { name } = state;
  if (!(await attempt(() => removeRobot(name)))) return;
  byId("robot-dialog").close();
  state.changed("");
  showUndo(t("robot.removed", { name }), RESTORE, name);
}

function partRow([part, body]) {
  const words = t(`robot.part.${part}`);
  return h("tr", {}, h("th", { scope: "row" }, words), h("td", {},
    h("select", { id: `robot-part-${part}`, aria: { label: t("robot.body_of", { part: words }) }, onchange: (event) => correct({ parts: { [part]: event.currentTarget.value } }) },
      state.facts.bodies.map((one) => h("option", { value: one, selected: one === body }, one)))));
}

function jointRow({ name, low_rad: low, high_rad: high, velocity_rad_s: velocity, torque_nm: torque, turns }) {
  const cells = [number(low * DEGREES, 0), number(high * DEGREES, 0), number(velocity, 1), torque === null ? "–" : number(torque, 0), t(`robot.turns.${turns}`)];
  return h("tr", {}, h("th", { scope: "row" }, name), cells.map((cell) => h("td", {}, cell)));
}

function jointTable() {
  const head = h("thead", {}, h("tr", {}, ["joint", "from", "to", "velocity", "torque", "axis"].map((key) => h("th", { scope: "col" }, t(`robot.${key}`)))));
  return h("details", { class: "mapping" }, h("summary", {}, t("robot.joints", { n: state.facts.joints.length })),
    h("table", { class: "robot-joints" }, head, h("tbody", {}, state.facts.joints.map(jointRow))));
}

function velocityField() {
  const rates = [...new Set(state.facts.joints.map((one) => one.velocity_rad_s))];
  return h("label", { class: "pair", title: t("robot.velocity_hint") }, t("robot.velocity_of_all"), h("input", {
    id: "robot-velocity", type: "number", min: 0.1, max: 1000, step: "any", value: rates.length === 1 ? Math.round(1000 * rates[0]) / 1000 : "", placeholder: t("robot.velocity_own"),
    onchange: (event) => { if (event.currentTarget.value && event.currentTarget.reportValidity()) correct({ velocity_rad_s: Number(event.currentTarget.value) }); },
  }));
}

function content() {
  const { facts } = state;
  const sizes = { height: number(facts.height_m, 2), mass: number(facts.mass_kg, 1), leg: number(facts.leg_m, 2), n: facts.joints.length, moved: facts.moved };
  return [
    h("p", {}, t("robot.sizes", sizes)),
    facts.notes.length > 0 && h("ul", { class: "hint" }, facts.notes.map((note) => h("li", {}, said(note)))),
    h("details", { class: "mapping", open: true }, h("summary", {}, t("robot.parts")), h("table", {}, h("tbody", {}, Object.entries(facts.parts).map(partRow)))),
    velocityField(),
    jointTable(),
  ];
}

function draw() {
  const { name, facts, busy } = state;
  byId("robot-dialog").replaceChildren(...[
    h("h2", {}, name),
    busy && h("p", { class: "muted" }, busy), busy && h("progress", { aria: { label: busy } }),
    ...(facts && !busy ? content() : []),
    h("form", { method: "dialog", class: "buttons" },
      h("button", { type: "submit", class: "primary" }, t("message.close")),
      h("button", { type: "button", id: "robot-remove", class: "danger", disabled: Boolean(busy), onclick: remove }, t("robot.remove"))),
  ].filter(Boolean));
}
