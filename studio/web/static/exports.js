// Exports of a solve: a file by a click, or with options from a dialog that keeps what was chosen last.
import { h } from "./dom.js";
import { exportSolve } from "./api.js";
import { attempt } from "./messages.js";

const SKELETONS = ["fbx", "bvh", "glb", "usd"];
const CHOICES = [ // name, label, values, formats that have it (null: all)
  ["format", "Format", ["fbx", "bvh", "glb", "usd", "c3d", "trc", "csv", "npz"], null],
  ["target", "Skeleton", ["humanik", "mixamo", "unreal", "vrm"], SKELETONS],
  ["root_motion", "Path on", ["hips", "root", "in-place"], SKELETONS],
  ["interpolation", "Between keys", ["cubic", "linear", "constant"], ["fbx", "glb"]],
  ["fps", "Frames a second", ["", "24", "25", "30", "60", "120"], null],
];
const NUMBERS = [
  ["start_s", "From [s]", 0, null],
  ["end_s", "To [s]", 0, null],
  ["smooth_hz", "Smooth above [Hz]", 1, null],
  ["key_error_cm", "Fewer keys, error [cm]", 0.01, ["fbx"]],
];
const FLAGS = [
  ["mesh", "Body", ["fbx", "glb", "usd"]],
  ["loop", "Best loop", null],
  ["foot_lock", "Hold standing feet", null],
];

const chosen = { format: "fbx" };

/** Download an export of a solve; `options` as the API has them. */
export async function download(take, solve, options, button) {
  button.disabled = true;
  const file = await attempt(() => exportSolve(take, solve, options));
  button.disabled = false;
  if (!file) return false;
  const link = h("a", { href: URL.createObjectURL(file), download: `${take.name}_${solve}.${options.format}` });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  return true;
}

/** Return the options that the format has, of those chosen. */
function wanted() {
  const formats = Object.fromEntries([...CHOICES, ...NUMBERS, ...FLAGS].map((field) => [field[0], field.at(-1)]));
  const has = ([name, value]) => value !== "" && value !== false && (formats[name]?.includes(chosen.format) ?? true);
  return Object.fromEntries(Object.entries(chosen).filter(has));
}

function field(name, label, control, formats) {
  const row = h("div", { class: "switch" }, h("label", { htmlFor: `export-${name}` }, label), control);
  if (formats) row.dataset.formats = formats.join(" ");
  control.id = `export-${name}`;
  return row;
}

function fields(update) {
  const keep = (name, value) => { chosen[name] = value; update(); };
  return [
    ...CHOICES.map(([name, label, values, formats]) => field(name, label, h("select", {
      onchange: (event) => keep(name, event.target.value),
    }, values.map((value) => h("option", { value, selected: value === (chosen[name] ?? values[0]) }, value || "as solved"))), formats)),
    ...NUMBERS.map(([name, label, least, formats]) => field(name, label, h("input", {
      type: "number", min: least, step: "any", value: chosen[name] ?? "", oninput: (event) => keep(name, event.target.value),
    }), formats)),
    ...FLAGS.map(([name, label, formats]) => field(name, label, h("input", {
      type: "checkbox", checked: chosen[name] ?? false, onchange: (event) => keep(name, event.target.checked),
    }), formats)),
  ];
}

/** Show the options of an export of this solve. */
export function showExport(take, solve) {
  const update = () => {
    for (const row of dialog.querySelectorAll("[data-formats]")) {
      row.hidden = !row.dataset.formats.split(" ").includes(chosen.format);
    }
  };
  const go = h("button", { type: "button", onclick: async (event) => {
    if (await download(take, solve, wanted(), event.currentTarget)) dialog.close();
  } }, "Export");
  const dialog = h("dialog", { class: "export", aria: { label: `Export ${take.name}, solve ${solve}` }, onclose: () => dialog.remove() },
    h("h2", {}, `Export ${take.name}, ${solve}`), fields(() => update()),
    h("form", { method: "dialog" }, go, h("button", { type: "submit" }, "Close")));
  document.body.append(dialog);
  update();
  dialog.showModal();
}
