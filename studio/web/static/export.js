// The export dialog: format, target, rate, root motion, mesh, keys, trim and clean-up, of one take or several.
import { byId, h } from "./dom.js";
import { exportSolve } from "./api.js";
import { attempt, showNote } from "./messages.js";
import { replayed } from "./replay.js";
import { t } from "./strings.js";

const FORMATS = ["fbx", "bvh", "glb", "usd", "c3d", "trc", "csv", "npz"];
const TARGETS = ["humanik", "mixamo", "unreal", "vrm"];
const ROOTS = ["hips", "root", "in-place"];
const KEYS = ["cubic", "linear", "constant"];
const RATES = ["", 24, 25, 30, 60, 120];
const SKELETONS = ["fbx", "bvh", "glb", "usd"];
const KEPT = "export";

// Which fields a format understands; the others are hidden.
const FIELDS = {
  target: SKELETONS, root_motion: SKELETONS, interpolation: ["fbx", "glb"], mesh: ["fbx", "glb", "usd"], key_error_cm: ["fbx"],
};

const state = { jobs: [] };

const named = (values, words) => Object.fromEntries(values.map((value) => [value, words(value)]));

function select(id, label, options, value) {
  return h("label", { class: "field" }, h("span", {}, label), h("select", { id: `export-${id}`, onchange: id === "format" ? showFields : undefined },
    Object.entries(options).map(([key, text]) => h("option", { value: key, selected: key === value }, text))));
}

function number(id, label, value, placeholder) {
  return h("label", { class: "field" }, h("span", {}, label), h("input", { id: `export-${id}`, type: "number", min: 0, step: "any", value: value ?? "", placeholder }));
}

const check = (id, label, checked) => h("label", { class: "check" }, h("input", { id: `export-${id}`, type: "checkbox", checked }), label);

function trim() {
  const replay = replayed();
  const one = state.jobs.length === 1 && replay.open && replay.take === state.jobs[0].take.id;
  if (!one) return {};
  return { start: replay.first > 0 ? (replay.first / replay.rate_hz).toFixed(2) : undefined,
    end: replay.last < replay.frames - 1 ? (replay.last / replay.rate_hz).toFixed(2) : undefined };
}

function fields(kept) {
  const { start, end } = trim();
  return [
    select("format", t("export.format"), named(FORMATS, (name) => t(`export.format.${name}`)), kept.format ?? "fbx"),
    select("target", t("export.target"), named(TARGETS, (name) => t(`export.target.${name}`)), kept.target ?? "humanik"),
    h("label", { class: "field" }, h("span", {}, t("export.rate")), h("select", { id: "export-fps" },
      RATES.map((rate) => h("option", { value: rate, selected: String(rate) === String(kept.fps ?? "") }, rate || t("export.as_solved"))))),
    select("root_motion", t("export.root"), named(ROOTS, (name) => t(`export.root.${name}`)), kept.root_motion ?? "hips"),
    select("interpolation", t("export.keys"), named(KEYS, (name) => t(`export.keys.${name}`)), kept.interpolation ?? "cubic"),
    h("div", { class: "two" }, number("start_s", t("export.from"), start, t("export.start")), number("end_s", t("export.to"), end, t("export.end"))),
    h("div", { class: "two" },
      h("div", {}, check("mesh", t("export.mesh"), kept.mesh), check("foot_lock", t("export.foot_lock")), check("loop", t("export.loop"))),
      h("div", {}, number("smooth_hz", t("export.smooth"), "", t("export.off")), number("key_error_cm", t("export.fewer_keys"), "", t("export.off")))),
  ];
}

function showFields() {
  const format = byId("export-format").value;
  for (const [id, formats] of Object.entries(FIELDS)) {
    byId(`export-${id}`).closest(".field, .check").hidden = !formats.includes(format);
  }
}

function chosen() {
  const format = byId("export-format").value;
  const value = (id) => byId(`export-${id}`).value;
  const query = { format, fps: value("fps"), start_s: value("start_s"), end_s: value("end_s"), smooth_hz: value("smooth_hz") };
  for (const id of ["target", "root_motion", "interpolation", "key_error_cm"]) if (FIELDS[id].includes(format)) query[id] = value(id);
  if (FIELDS.mesh.includes(format)) query.mesh = byId("export-mesh").checked;
  for (const id of ["foot_lock", "loop"]) if (byId(`export-${id}`).checked) query[id] = true;
  return Object.fromEntries(Object.entries(query).filter(([, text]) => text !== ""));
}

async function run(event) {
  event.preventDefault();
  const query = chosen();
  const { format, target, fps, root_motion, interpolation, mesh } = query;
  localStorage.setItem(KEPT, JSON.stringify({ format, target, fps, root_motion, interpolation, mesh }));
  const button = byId("export-run"), bar = byId("export-progress");
  button.disabled = true;
  bar.hidden = false;
  bar.removeAttribute("value");
  let written = 0;
  for (const { take, solve } of state.jobs) {
    const file = await attempt(() => exportSolve(take, solve, query));
    if (file) {
      save(file, `${take.name}_${solve}.${format}`);
      written += 1;
    }
    bar.value = written / state.jobs.length;
  }
  button.disabled = false;
  bar.hidden = true;
  if (written === state.jobs.length) {
    byId("export-dialog").close();
    showNote(t("export.done", { n: written }));
  }
}

function save(file, name) {
  const link = h("a", { href: URL.createObjectURL(file), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

/** Ask how solves are exported, `[{take, solve}]`, and download the files. */
export function askExport(jobs) {
  state.jobs = jobs;
  const kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
  const dialog = byId("export-dialog");
  const title = jobs.length === 1 ? t("export.one", { take: jobs[0].take.name, solve: jobs[0].solve }) : t("export.many", { n: jobs.length });
  dialog.replaceChildren(h("h2", {}, title),
    h("form", { class: "export-form", onsubmit: run }, ...fields(kept),
      h("progress", { id: "export-progress", max: 1, hidden: true, aria: { label: t("export.progress") } }),
      h("div", { class: "buttons" },
        h("button", { id: "export-run", class: "primary", type: "submit" }, t("export.short")),
        h("button", { type: "button", onclick: () => dialog.close() }, t("message.cancel")))));
  showFields();
  dialog.showModal();
}
