// Rigid bodies of other systems: which systems are received, and what each body is.
import { byId, h, redraw } from "../base/dom.js";
import { changeRigidBodies, getRigidBodies } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";
import { bodyRow, heldWords, jointWords } from "./body_row.js";

const SYSTEMS = { natnet: ["natnet_server", "natnet_port"], osc: ["host", "osc_port"] };
const NUMBERS = ["natnet_port", "osc_port"];
const panel = { settings: null, status: null, measured: [] };

const change = (changes) => attempt(async () => {
  const shown = await changeRigidBodies(changes);
  Object.assign(panel, shown);
  draw();
});

const valueOf = (name, text) => (NUMBERS.includes(name) ? Number(text) : text.trim());

/** Change the settings of a body; one without settings is only shown. */
function say(name, changes) {
  const { bodies } = panel.settings;
  const before = bodies.find((one) => one.name === name) ?? { name, use: "prop", joint: "", performer: "performer_1", shape: null };
  const after = { ...before, ...changes };
  change({ bodies: [...bodies.filter((one) => one.name !== name), ...(after.use ? [after] : [])] });
}

function shapeOf(text) {
  const [kind, sizes] = text.trim().split(":");
  const parts = (sizes ?? "").split(",").map((one) => one.trim());
  const axis = ["x", "y", "z"].includes(parts.at(-1)) ? parts.pop() : "z";
  return kind ? { kind, size_cm: parts.map(Number), axis } : null;
}

/** Return in words how a prop is used, or whether a body that is evidence pins the live solve. */
function tie(name, known) {
  if (known?.use === "prop") return heldWords(known);
  if (known?.use !== "evidence") return "";
  const measured = panel.settings.ties[name];
  return measured ? t("rigid.pins", { joint: jointWords(known.joint), mm: number(measured.residual_mm, 0) }) : t("rigid.pins_not");
}

/** Choice of the take whose measured body placements pin joints in the live solve. */
function likeTake() {
  const options = panel.measured.map((one) => h("option", { value: one }, one));
  return h("label", { class: "field" }, h("span", { title: t("rigid.like.hint") }, t("rigid.like")),
    h("select", { id: "rigid-like", title: t("rigid.like.hint"), disabled: !options.length, onchange: (event) => change({ like_take: event.currentTarget.value }) },
      [h("option", { value: "", selected: true, disabled: true }, t(options.length ? "rigid.like.choose" : "rigid.like.none")), ...options]));
}

function body({ name, seen }) {
  const known = panel.settings.bodies.find((one) => one.name === name);
  const saying = ({ shape, ...changes }) => say(name, { ...changes, ...(shape !== undefined && { shape: shapeOf(shape) }) });
  return bodyRow(name, { seen: t(seen ? "rigid.seen" : "rigid.unseen"), known, below: tie(name, known), say: saying });
}

/** Return what a system sends, in words: only NatNet sends markers. */
function come(name, { packets }) {
  const { bodies, markers, loose_markers: loose } = panel.status;
  if (name !== "natnet" || !markers && !loose) return t(packets ? "rigid.comes" : "set.nothing");
  return [bodies.some(({ seen }) => seen) && t("rigid.comes"), markers && t("rigid.markers", { n: markers }), loose && t("rigid.loose", { n: loose })].filter(Boolean).join(", ");
}

function system(name) {
  const { settings, status } = panel;
  const one = status[name];
  const fields = SYSTEMS[name].map((key) => h("label", { class: "field" }, h("span", {}, t(`rigid.${key}`)),
    h("input", { id: `rigid-${key}`, type: "text", spellcheck: false, value: String(settings[key]), onchange: (event) => change({ [key]: valueOf(key, event.currentTarget.value) }) })));
  const words = one.problem ? said(one.problem) : [one.server, come(name, one), one.refused && t("rigid.refused", { n: one.refused })].filter(Boolean).join(", ");
  return h("li", { class: "trigger" },
    h("label", { class: "check" },
      h("input", { id: `rigid-${name}`, type: "checkbox", checked: settings[name], onchange: (event) => change({ [name]: event.currentTarget.checked }) }),
      h("span", { class: "name", title: t(`rigid.${name}.hint`) }, t(`rigid.${name}`))),
    h("div", { class: "set-row" }, fields),
    one.on && h("p", { class: one.problem ? "bad" : "count" }, words));
}

function draw() {
  const { settings, status, measured } = panel;
  const focused = document.activeElement;
  if (!settings || !status || byId("rigid").contains(focused) && focused.matches("input[type=text], select")) return;
  // what changes by itself causes no redraw
  const systems = Object.keys(SYSTEMS).map((name) => ({ ...status[name], packets: status[name].packets > 0 }));
  const shown = [systems, status.problem, status.markers, status.loose_markers, status.bodies.map(({ name, seen }) => [name, seen])];
  redraw(byId("rigid"), [settings, shown, measured], () => [
    h("h3", {}, t("rigid.title")),
    status.problem && h("p", { class: "bad" }, said(status.problem)),
    h("ul", { class: "triggers" }, Object.keys(SYSTEMS).map(system), status.bodies.map(body)),
    status.bodies.length > 0 && likeTake(),
  ].filter(Boolean));
}

/** Show the received rigid bodies, as last reported by the server. */
export function updateRigid(status) {
  panel.status = status;
  draw();
}

const ask = () => attempt(async () => {
  const { settings, measured } = await getRigidBodies();
  Object.assign(panel, { settings, measured });
  draw();
});

/** Request the settings, and again when the pointer enters the panel, as takes may have been measured since. */
export function startRigid() {
  byId("rigid").addEventListener("pointerenter", ask);
  ask();
}
