// The form for edits over a range: contacts, doubts, offsets, trims, change of pace; and for looping the range.
import { byId, h } from "../base/dom.js";
import { t } from "../base/strings.js";
import { performerWords, several } from "../replay/performers.js";
import { askSplice } from "../takes/splice.js";
import { add } from "./list.js";
import { stageOf } from "./time.js";
import { OUTPUT, TOUCHING } from "./words.js";

const LOOPED = 4; // times
const AROUND_S = 0.25; // where no range is chosen
const FIELDS = { // which fields a kind has
  contact_floor: ["touching"], contact_joint: ["touching", "touched"], contact_other: ["touching", "other", "touched"], contact_nothing: ["touching"], leave_out: ["camera", "joint"], exchange_sides: ["camera"], offset: ["output", "turn"], trim: [], retime: ["factor"],
};
const kept = { kind: "contact_floor", touching: "left_ankle", touched: "left_hip", other: "", camera: "", joint: "", output: "LeftForeArm", turn: [0, 0, 0], factor: 2, typed: {} }; // as last chosen; times that were typed

/** Return the chosen range [s since the take's beginning]; around the playhead if there is none. */
function rangeOf({ first, last, frames, frame, rate_hz: rate }) {
  if (first > 0 || last < frames - 1) return [first / rate, last / rate];
  return [Math.max(frame / rate - AROUND_S, 0), Math.min(frame / rate + AROUND_S, (frames - 1) / rate)];
}

const select = (id, label, options, value, onchange) => h("label", { class: "field" }, h("span", {}, label),
  h("select", { id, onchange: (event) => onchange(event.currentTarget.value) }, options.map(([key, text]) => h("option", { value: key, selected: key === value }, text))));

const jointOptions = (joints) => joints.map((joint) => [joint, t(`joint.${joint}`)]);

function numbered(id, label, value, step, onchange) {
  return h("label", { class: "field" }, h("span", {}, label), h("input", { id, type: "number", value, step, oninput: (event) => onchange(event.currentTarget.valueAsNumber) }));
}

function fields(cameras, others) {
  const all = ["", t("mend.all_cameras")], every = ["", t("mend.all_joints")];
  return {
    touching: () => [select("edit-touching", t("mend.joint"), jointOptions(TOUCHING), kept.touching, (value) => { kept.touching = value; })],
    touched: () => [select("edit-touched", t("mend.touched"), jointOptions(Object.keys(OUTPUT)), kept.touched, (value) => { kept.touched = value; })],
    other: () => [select("edit-other", t("mend.other"), others.map(({ performer, name }) => [performer, performerWords(name)]), kept.other, (value) => { kept.other = value; })],
    camera: () => [select("edit-camera", t("mend.camera"), [all, ...cameras.map((name) => [name, name])], kept.camera, (value) => { kept.camera = value; })],
    joint: () => [select("edit-joint", t("mend.joint"), [every, ...jointOptions(Object.keys(OUTPUT))], kept.joint, (value) => { kept.joint = value; })],
    output: () => [select("edit-output", t("mend.joint"), Object.values(OUTPUT).map((name) => [name, name]), kept.output, (value) => { kept.output = value; })],
    turn: () => ["X", "Y", "Z"].map((axis, k) => numbered(`edit-turn-${k}`, `${axis} [°]`, kept.turn[k], 1, (value) => { kept.turn[k] = value || 0; })),
    factor: () => [numbered("edit-factor", t("mend.factor"), kept.factor, 0.1, (value) => { kept.factor = value || 1; })],
  };
}

/** Return the content of the form as an edit. */
function edit(replay) {
  const stage = (id) => stageOf(byId(id).valueAsNumber);
  const common = { start_s: stage("edit-from"), end_s: stage("edit-to"), ...(replay.performer && { performer: replay.performer }) };
  const camera = kept.camera || null;
  return {
    contact_floor: () => ({ kind: "contact", joint: kept.touching, touches: "floor", ...common }),
    contact_joint: () => ({ kind: "contact", joint: kept.touching, touches: kept.touched, ...common }),
    contact_other: () => ({ kind: "contact", joint: kept.touching, touches: kept.touched, other: kept.other, ...common }),
    contact_nothing: () => ({ kind: "contact", joint: kept.touching, touches: "nothing", ...common }),
    leave_out: () => ({ kind: "leave_out", camera, joints: kept.joint ? [kept.joint] : [], ...common }),
    exchange_sides: () => ({ kind: "exchange_sides", camera, ...common }),
    offset: () => ({ kind: "offset", joint: kept.output, rotation_deg: kept.turn, ...common }),
    trim: () => ({ kind: "trim", ...common }),
    retime: () => ({ kind: "retime", factor: kept.factor, ...common }),
  }[kept.kind]();
}

/** Set the form's times to the chosen range, or around the playhead, unless they were typed. */
export function showRange(replay) {
  rangeOf(replay).forEach((seconds, k) => {
    const id = ["edit-from", "edit-to"][k];
    if (byId(id) && kept.typed[id] === undefined) byId(id).value = seconds.toFixed(2);
  });
}

/** Return the form, collapsed at first. */
export function rangeForm(replay, { cameras }) {
  const others = several(replay) ? replay.performers.filter(({ performer }) => performer !== replay.performer) : [];
  const [from, to] = rangeOf(replay), makers = fields(cameras, others), kinds = Object.keys(FIELDS).filter((kind) => kind !== "contact_other" || others.length);
  if (!kinds.includes(kept.kind)) [kept.kind] = kinds;
  if (!others.some(({ performer }) => performer === kept.other)) kept.other = others[0]?.performer ?? "";
  const own = h("div", { class: "edit-fields" });
  const time = (id, label, seconds) => numbered(id, label, kept.typed[id] ?? seconds.toFixed(2), "any", (value) => { kept.typed[id] = value; });
  const fill = () => own.replaceChildren(...FIELDS[kept.kind].flatMap((name) => makers[name]()));
  fill();
  return h("details", { id: "edit-range", class: "operate" }, h("summary", {}, t("mend.over")),
    h("form", { class: "stack", onsubmit: (event) => { event.preventDefault(); add(edit(replay)); kept.typed = {}; } },
      select("edit-kind", t("mend.what"), kinds.map((kind) => [kind, t(`mend.form.${kind}`)]), kept.kind, (value) => { kept.kind = value; fill(); }),
      own,
      h("div", { class: "edit-fields" }, time("edit-from", t("mend.from"), from), time("edit-to", t("mend.to"), to)),
      h("div", { class: "buttons" }, h("button", { id: "edit-add", type: "submit", class: "small" }, t("mend.add")),
        h("button", { id: "edit-loop", type: "button", class: "small", title: t("mend.loop_hint"), onclick: () => loop(replay) }, t("mend.loop")))));
}

/** Make a new take that repeats the range. */
function loop({ take: id, solve, performer }) {
  const [session, name] = [id.slice(0, id.indexOf("/")), id.slice(id.indexOf("/") + 1)];
  const [start_s, end_s] = ["edit-from", "edit-to"].map((field) => byId(field).valueAsNumber);
  return askSplice([{ take: { id, session, name }, solve, performer, start_s, end_s }], LOOPED);
}
