// Known values for calibrating cameras without depth: the performer's height, and their lenses.
import { byId, h } from "../base/dom.js";
import { t } from "../base/strings.js";

const LANDMARKS = "mediapipe"; // the joints of cameras that see no depth
const KINDS = ["unknown", "field", "focal", "file"];
const USUAL = { field: { value: "65", off: "2" }, focal: { value: "", off: "" } };
const TALL = ["performer-tall", "wizard-tall", "take-tall"]; // fields of one height
const known = { height: "", same: false, lenses: new Map() }; // camera -> {kind, value, off, file, text}

/** Whether a joint set belongs to cameras without depth. */
export const seesNoDepth = (jointSet) => jointSet === LANDMARKS;

/** Return the names of the connected cameras without depth. */
export const withoutDepth = (cameras) => Object.entries(cameras)
  .filter(([, camera]) => camera.connected && seesNoDepth(camera.joint_set)).map(([name]) => name).sort();

const lensOf = (name) => known.lenses.get(name) ?? { kind: "unknown" };

function typeHeight(value) {
  known.height = value;
  for (const id of TALL) if (byId(id) && byId(id).value !== value) byId(id).value = value;
}

/** Return a field for the performer's height: cameras without depth do not measure it. */
export function tallField(id) {
  return h("label", { class: "pair", title: t("performer.tall_hint") }, t("performer.tall"), h("input", {
    id, type: "number", min: 0.8, max: 2.3, step: 0.01, placeholder: "1.75", value: known.height,
    oninput: (event) => typeHeight(event.currentTarget.value),
  }));
}

/** Return the known values for calibrating these cameras without depth, in the form of the request. */
export function knownNow(flat) {
  const lenses = {};
  for (const name of flat) {
    const { kind, value, off, file, text } = lensOf(name);
    if (kind === "file" && file) lenses[name] = { file, text };
    if (kind === "field" && value) lenses[name] = { field_deg: Number(value), off: Number(off) };
    if (kind === "focal" && value) lenses[name] = { focal_px: Number(value), off: Number(off) };
  }
  return {
    ...(flat.length && known.height && { height_m: Number(known.height) }),
    ...(Object.keys(lenses).length && { lenses }),
    ...(flat.length && known.same && { same_lens: true }),
  };
}

/** Return the key by which the fields are redrawn. */
export const knownShown = (flat) => flat.map((name) => [name, lensOf(name).kind, lensOf(name).file]);

function numberField(name, what, unit) {
  return h("input", {
    class: `lens-${what}`, type: "number", min: 0, step: "any", value: lensOf(name)[what] ?? "", aria: { label: t(`lens.${what}`, { name, unit }) },
    oninput: (event) => { lensOf(name)[what] = event.currentTarget.value; },
  });
}

function fileField(name, changed) {
  const { file } = lensOf(name);
  const field = h("input", {
    type: "file", accept: ".json,.toml", hidden: true, aria: { label: t("lens.file_of", { name }) },
    onchange: async () => {
      const [chosen] = field.files;
      if (chosen) Object.assign(lensOf(name), { file: chosen.name, text: await chosen.text() });
      changed();
    },
  });
  return [h("button", { type: "button", class: "small", onclick: () => field.click() }, file || t("lens.choose")), field];
}

function lensRow(name, changed) {
  const { kind } = lensOf(name);
  const choose = h("select", {
    class: "lens-kind", aria: { label: t("lens.of", { name }) },
    onchange: (event) => {
      const { value } = event.currentTarget;
      known.lenses.set(name, { kind: value, ...USUAL[value] });
      changed();
    },
  }, KINDS.map((one) => h("option", { value: one, selected: one === kind }, t(`lens.${one}`))));
  const unit = kind === "field" ? "°" : "px";
  const fields = kind === "unknown" ? [] : kind === "file" ? fileField(name, changed)
    : [numberField(name, "value", unit), "±", numberField(name, "off", unit), unit];
  return h("li", { class: "lens" }, h("strong", {}, name), choose, fields);
}

/** Return the fields for known values of these cameras without depth; `place`: prefix of their ids; `changed()`: other fields are needed. */
export function knownFields(flat, place, changed) {
  if (!flat.length) return [];
  const same = h("input", { id: `${place}-same`, type: "checkbox", checked: known.same, onchange: (event) => { known.same = event.currentTarget.checked; } });
  return [h("p", {}, t("lens.words")), tallField(`${place}-tall`), h("ul", {}, flat.map((name) => lensRow(name, changed))),
    flat.length > 1 && h("label", { class: "lens-same", title: t("lens.same_hint") }, same, t("lens.same"))].filter(Boolean);
}
