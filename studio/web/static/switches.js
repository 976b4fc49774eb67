// The solve panel: a preset and every switch of the API's catalogue, each with its explanation.
import { byId, h, setText } from "./dom.js";
import { hasText, serverText, t } from "./strings.js";

const GROUPS = [
  ["input", ["cameras", "tracker", "confidence_threshold", "output_hz"]],
  ["solve", ["fusion", "ik", "human_limits", "flexibility", "relax_pose"]],
  ["conditioning", ["bone_length_limit", "displacement_limit", "smoothing"]],
  ["completion", ["look_at", "look_at_point_m", "hands", "floor_contact"]],
  ["whole", ["finish", "physics"]],
];

const plain = (text) => text.replaceAll("_", " ").replace(/^./, (first) => first.toUpperCase());
const nameOf = (key) => serverText(`switch.${key}`, plain(key));
const valueWords = (value) => String(value).split(":").map((part) => serverText(`value.${part}`, plain(part))).join(", ");
const valueHelp = (key, value) => (hasText(`value_help.${key}:${value}`) ? t(`value_help.${key}:${value}`) : "");
const presetWords = (name) => serverText(`preset.${name}`, plain(name));

/** Groups of switches in the order of the page; switches that no group names come last. */
function grouped(catalogue) {
  const known = new Set(GROUPS.flatMap(([, keys]) => keys));
  const rest = catalogue.map((item) => item.key).filter((key) => !known.has(key));
  return [...GROUPS, ["more", rest]]
    .map(([title, keys]) => [title, keys.map((key) => catalogue.find((item) => item.key === key)).filter(Boolean)])
    .filter(([, items]) => items.length);
}

export class Switches {
  /** `switches`: [{key, kind, values, low, high, help}]; `presets`: {name: {key: text}}. */
  constructor({ switches, presets }, onChange) {
    this.catalogue = switches;
    this.presets = presets;
    this.onChange = onChange;
    this.controls = new Map();
    this.preset = "studio" in presets ? "studio" : Object.keys(presets)[0];
    this.values = { ...presets[this.preset] };
    byId("solve").replaceChildren(...this.build());
    this.refresh();
  }

  /** What differs from the preset: {key: text}. */
  changes() {
    const base = this.presets[this.preset];
    return Object.fromEntries(Object.entries(this.values).filter(([key, value]) => value !== base[key]));
  }

  /** Show settings as the server has them. */
  show({ preset, set }) {
    if (preset in this.presets) this.preset = preset;
    this.values = { ...this.presets[this.preset], ...set };
    this.refresh();
  }

  build() {
    const preset = h("select", { id: "preset", onchange: (event) => this.choosePreset(event.target.value) },
      Object.keys(this.presets).map((name) => h("option", { value: name, title: serverText(`preset_help.${name}`, "") }, presetWords(name))));
    this.reset = h("button", { class: "small", type: "button", onclick: () => this.choosePreset(this.preset) }, t("solve.reset"));
    const head = h("div", { class: "row" },
      h("label", { class: "field grow", htmlFor: "preset" }, h("span", {}, t("solve.preset")), preset), this.reset);
    this.presetSelect = preset;
    const groups = grouped(this.catalogue).map(([title, items]) =>
      h("div", { class: "group" }, h("h3", {}, t(`group.${title}`)), items.map((item) => this.row(item))));
    return [head, h("details", { id: "switches" }, h("summary", {}, t("solve.all")), groups)];
  }

  row(item) {
    const id = `switch-${item.key}`;
    const control = this.control(item, id);
    const row = h("div", { class: "switch" },
      h("label", { htmlFor: id }, nameOf(item.key)), control.element,
      h("p", { class: "help", id: `${id}-help`, role: "tooltip" }, h("span", {}, serverText(`switch_help.${item.key}`, item.help)), h("strong", { hidden: true })));
    this.controls.set(item.key, { ...control, row });
    return row;
  }

  control(item, id) {
    const change = (value) => this.change(item.key, String(value));
    const described = { describedby: `${id}-help` };
    if (item.kind === "choice") {
      const select = h("select", { id, aria: described, onchange: () => change(select.value) },
        item.values.map((value) => h("option", { value, title: valueHelp(item.key, value) }, valueWords(value))));
      return { element: select, set: (value) => { select.value = value; } };
    }
    if (item.kind === "range") {
      const step = (item.high - item.low) / 100;
      const range = h("input", { type: "range", id, min: item.low, max: item.high, step, aria: described,
        oninput: () => { number.value = range.value; }, onchange: () => change(range.value) });
      const number = h("input", { type: "number", min: item.low, max: item.high, step,
        aria: { label: nameOf(item.key), ...described }, onchange: () => change(number.value) });
      return { element: h("div", { class: "slider" }, range, number), set: (value) => { range.value = value; number.value = value; } };
    }
    const text = h("input", { type: "text", id, aria: described, spellcheck: false, onchange: () => change(text.value) });
    return { element: text, set: (value) => { text.value = value; } };
  }

  choosePreset(name) {
    this.preset = name;
    this.values = { ...this.presets[name] };
    this.refresh();
    this.onChange(this);
  }

  change(key, value) {
    this.values[key] = value;
    this.refresh();
    this.onChange(this);
  }

  refresh() {
    const changes = this.changes();
    const count = Object.keys(changes).length;
    this.presetSelect.value = this.preset;
    this.reset.disabled = count === 0;
    setText(byId("solve-summary"), count ? t("solve.changes", { n: count }) : "");
    for (const [key, control] of this.controls) {
      control.set(this.values[key] ?? "");
      control.row.classList.toggle("changed", key in changes);
      const about = control.row.querySelector(".help strong"), words = valueHelp(key, this.values[key]);
      about.hidden = !words;
      setText(about, `${valueWords(this.values[key] ?? "")}: ${words}`);
    }
  }
}
