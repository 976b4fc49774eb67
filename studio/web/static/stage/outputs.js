// The live output panel: programs that get the character while the stage runs, switched on and off one by one.
import { byId, h, redraw, setText } from "../base/dom.js";
import { addOutput, changeOutput, getOutputs, removeOutput } from "../base/api.js";
import { attempt, showUndo, undoing } from "../base/messages.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";

const KINDS = { vmc: { label: "VMC (OSC)", port: 39539 }, rokoko: { label: "Rokoko JSON v3", port: 14043 }, robot: { label: "JSON", port: 14600 } };
const RATES = [30, 50, 60, 100, 120];
const ROBOT_RATES = [50, 60, 100];
const PERIOD_MS = 2000;
const panel = { kind: "vmc", host: "127.0.0.1", port: "", rate: 60, performer: "", names: [], robot: "", robots: [] };

async function add(event) {
  event.preventDefault();
  const made = await attempt(() => addOutput({
    kind: panel.kind, host: panel.host.trim(), port: Number(panel.port) || 0, rate_hz: panel.rate, performer: panel.performer,
    ...(panel.kind === "robot" && { robot: panel.robot || panel.robots[0] }),
  }));
  if (made) await attempt(updateOutputs);
}

const alter = (name, change) => attempt(async () => { await changeOutput(name, change); await updateOutputs(); });

const REMOVE = undoing("output", (output) => attempt(async () => { await addOutput(output); await updateOutputs(); }));

function remove({ id, kind, host, port, rate_hz, performer, robot }, label) {
  return attempt(async () => {
    await removeOutput(id);
    showUndo(t("outputs.removed", { label }), REMOVE, { kind, host, port, rate_hz, performer, robot });
    await updateOutputs();
  });
}

const kindOf = ({ kind, robot }) => (kind === "robot" ? t("outputs.joints", { robot }) : KINDS[kind].label);

function row(output) {
  const label = t("outputs.to", { kind: kindOf(output), place: `${output.host}:${output.port}` });
  return h("li", { class: "output" },
    h("label", { class: "check" },
      h("input", {
        id: `output-${output.id}`, type: "checkbox", checked: output.enabled, aria: { label: t("outputs.send", { label }) },
        onchange: (event) => alter(output.id, { enabled: event.currentTarget.checked }),
      }),
      h("span", { class: "name", title: t("outputs.at_most", { kind: kindOf(output), rate: output.rate_hz }) },
        `${output.host}:${output.port}`)),
    h("span", { class: "count" }, `${kindOf(output)}, ${output.rate_hz} Hz${output.performer && `, ${output.performer}`}`),
    h("button", {
      class: "small", type: "button", aria: { label: t("outputs.remove", { label }) },
      onclick: () => remove(output, label),
    }, t("message.remove")),
    output.problem && h("p", { class: "bad" }, said(output.problem)));
}

function field(id, label) {
  return h("label", { class: `field ${id}` }, h("span", {}, label),
    h("input", {
      id: `output-${id}`, type: "text", value: panel[id], spellcheck: false, inputMode: id === "port" ? "numeric" : "text",
      placeholder: id === "port" ? String(KINDS[panel.kind].port) : "",
      oninput: (event) => { panel[id] = event.currentTarget.value; },
    }));
}

function form() {
  const kind = h("select", {
    id: "output-kind", aria: { label: t("outputs.what") },
    onchange: (event) => { panel.kind = event.currentTarget.value; attempt(updateOutputs); },
  }, Object.keys(KINDS).filter((value) => value !== "robot" || panel.robots.length).map((value) => h("option", { value, selected: value === panel.kind },
    value === "robot" ? t("outputs.robot") : KINDS[value].label)));
  const robot = panel.kind === "robot" && h("select", {
    id: "output-robot", aria: { label: t("outputs.which_robot") }, onchange: (event) => { panel.robot = event.currentTarget.value; },
  }, panel.robots.map((value) => h("option", { value, selected: value === panel.robot }, value)));
  const rates = panel.kind === "robot" ? ROBOT_RATES : RATES;
  if (!rates.includes(panel.rate)) panel.rate = 60;
  const rate = h("select", {
    id: "output-rate", aria: { label: t("outputs.rate") },
    onchange: (event) => { panel.rate = Number(event.currentTarget.value); },
  }, rates.map((value) => h("option", { value, selected: value === panel.rate }, `${value} Hz`)));
  const whose = panel.names.length > 0 && h("select", {
    id: "output-performer", aria: { label: t("people.of") }, onchange: (event) => { panel.performer = event.currentTarget.value; },
  }, ["", ...panel.names].map((value) => h("option", { value, selected: value === panel.performer }, value || t("people.all"))));
  return h("form", { class: "output-form", onsubmit: add },
    kind, robot, rate, whose, field("host", t("outputs.host")), field("port", t("outputs.port")),
    h("button", { type: "submit" }, t("message.add")));
}

/** Show the targets and their state. */
export async function updateOutputs() {
  const { outputs, problem } = await getOutputs();
  const on = outputs.filter((output) => output.enabled);
  setText(byId("outputs-count"), on.length ? t("outputs.on", { n: on.length }) : t("outputs.targets", { n: outputs.length }));
  const shown = outputs.map(({ sent, dropped, bytes, ...rest }) => rest);
  redraw(byId("outputs"), [shown, problem, panel.names, panel.robots, panel.kind], () => [
    problem && h("p", { class: "bad" }, problem),
    outputs.length > 0 && h("ul", {}, outputs.map(row)),
    form(),
  ].filter(Boolean));
}

/** Offer these performers as those whose motion is sent. */
export function outputsFor(names) {
  if (names.join("\n") === panel.names.join("\n")) return;
  panel.names = names;
  if (!names.includes(panel.performer)) panel.performer = "";
  attempt(updateOutputs);
}

/** Offer these kept robots as those whose joint targets are sent. */
export function outputRobots(names) {
  if (names.join("\n") === panel.robots.join("\n")) return;
  panel.robots = names;
  if (panel.kind === "robot" && !names.length) panel.kind = "vmc";
  attempt(updateOutputs);
}

/** Start showing the targets, and refresh them: network problems appear later. */
export function startOutputs() {
  attempt(updateOutputs);
  setInterval(() => { if (document.body.dataset.connection === "open" && byId("outputs").querySelector("li")) attempt(updateOutputs); }, PERIOD_MS);
}
