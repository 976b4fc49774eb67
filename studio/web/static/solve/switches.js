// The solve panel: a preset and every switch of the API's catalogue, each with its explanation.
import { byId, h, setText } from "../base/dom.js";
import { dropUndo, keepUndo, showUndo, undoing } from "../base/messages.js";
import { PresetChoice, presetWords } from "./presets.js";
import { hasText, serverText, t } from "../base/strings.js";

const GROUPS = [
  ["input", ["cameras", "tracker", "refine_cameras", "confidence_threshold", "output_hz", "bystanders"]],
  ["solve", ["fusion", "ik", "human_limits", "flexibility", "relax_pose"]],
  ["conditioning", ["bone_length_limit", "displacement_limit", "smoothing"]],
  ["completion", ["look_at", "look_at_point_m", "hands", "fingers", "floor_contact"]],
  ["whole", ["finish", "physics"]],
];

const plain = (text) => text.replaceAll("_", " ").replace(/^./, (first) => first.toUpperCase());
const nameOf = (key) => serverText(`switch.${key}`, plain(key));
const valueWords = (value) => String(value).split(":").map((part) => serverText(`value.${part}`, plain(part))).join(", ");
const valueHelp = (key, value) => (hasText(`value_help.${key}:${value}`) ? t(`value_help.${key}:${value}`) : "");
const OPEN = "switches-open";

/** Return the groups of switches in the order of the page; switches without a group come last. */
function grouped(catalogue) {
  const known = new Set(GROUPS.flatMap(([, keys]) => keys));
  const rest = catalogue.map((item) => item.key).filter((key) => !known.has(key));
  return [...GROUPS, ["more", rest]]
    .map(([title, keys]) => [title, keys.map((key) => catalogue.find((item) => item.key === key)).filter(Boolean)])
    .filter(([, items]) => items.length);
}

export class Switches {
  /** `switches`: [{key, kind, values, low, high, help}]; `presets`: {name: {key: text}}, `saved`: names of those that can be
   * changed; `place` returns the take that the switches apply to, "" for the stage; `onChange` is called for every choice and
   * returns `false` if it is refused, `onPresets` requests the catalogue again. */
  constructor({ switches, presets, saved }, place, onChange, onPresets) {
    this.place = place;
    this.catalogue = switches;
    this.presets = presets;
    this.saved = saved;
    this.onChange = onChange;
    this.onPresets = onPresets;
    this.controls = new Map();
    this.preset = "studio" in presets ? "studio" : Object.keys(presets)[0];
    this.values = { ...presets[this.preset] };
    undoing("switches", (before) => this.use(before), (before) => before.place === this.place());
    byId("solve").replaceChildren(...this.build());
    this.refresh();
  }

  /** What differs from the preset: {key: text}. */
  changes() {
    const base = this.presets[this.preset];
    return Object.fromEntries(Object.entries(this.values).filter(([key, value]) => value !== base[key]));
  }

  /** Update to a catalogue with other presets. */
  update({ presets, saved }) {
    const values = { ...this.values };
    Object.assign(this, { presets, saved });
    if (!(this.preset in presets)) this.preset = "studio";
    this.values = values;
    this.refresh();
  }

  /** Show settings as the server has them. */
  show({ preset, set }) {
    if (preset in this.presets) this.preset = preset;
    this.values = { ...this.presets[this.preset], ...set };
    this.refresh();
  }

  build() {
    this.choice = new PresetChoice({
      settings: () => ({ preset: this.preset, set: this.changes() }),
      onChoose: (name) => this.choosePreset(name),
      onReset: () => this.choosePreset(this.preset),
      onSaved: (name) => this.onPresets(name),
    });
    const groups = grouped(this.catalogue).map(([title, items]) =>
      h("div", { class: "group" }, h("h3", {}, t(`group.${title}`)), items.map((item) => this.row(item))));
    const all = h("details", {
      id: "switches", open: sessionStorage.getItem(OPEN) === "true", ontoggle: (event) => sessionStorage.setItem(OPEN, String(event.target.open)),
    }, h("summary", {}, t("solve.all")), groups);
    return [...this.choice.elements, all];
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

  /** Use a preset unchanged; the switches that this resets can be restored. */
  choosePreset(name) {
    const before = this.now();
    const lost = Object.keys(this.changes()).length;
    this.use({ preset: name, values: { ...this.presets[name] } });
    if (lost) showUndo(t("solve.put_back", { n: lost, name: presetWords(name) }), "switches", before);
    else if (name !== before.preset) keepUndo(t("solve.preset_chosen", { name: presetWords(name) }), "switches", before);
  }

  /** State that undoing a change needs. */
  now() {
    return { preset: this.preset, values: { ...this.values }, place: this.place() };
  }

  use({ preset, values }) {
    Object.assign(this, { preset, values });
    this.refresh();
    this.onChange(this);
  }

  change(key, value) {
    const act = keepUndo(t("solve.switched", { name: nameOf(key), from: valueWords(this.values[key] ?? ""), to: valueWords(value) }), "switches", this.now());
    this.values[key] = value;
    this.refresh();
    Promise.resolve(this.onChange(this)).then((taken) => taken === false && dropUndo(act));
  }

  refresh() {
    const changes = this.changes();
    const count = Object.keys(changes).length;
    this.choice.show(Object.keys(this.presets), this.saved, this.preset, count > 0);
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
