// The choice of a preset, and the actions on saved ones: save, rename, remove; each can be undone.
import { h } from "../base/dom.js";
import { getPresets, removePreset, renamePreset, savePreset } from "../base/api.js";
import { askName } from "../base/ask.js";
import { attempt, showUndo, undoing } from "../base/messages.js";
import { hasText, t } from "../base/strings.js";

export const presetWords = (name) => (hasText(`preset.${name}`) ? t(`preset.${name}`) : name);

export class PresetChoice {
  /** `onChoose` gets the name of a preset, `onReset` nothing, `onSaved` the name of the preset to use after the list changed. */
  constructor({ settings, onChoose, onReset, onSaved }) {
    this.settings = settings;
    this.onSaved = onSaved;
    this.select = h("select", { id: "preset", onchange: (event) => onChoose(event.target.value) });
    const button = (key, act) => h("button", { class: "small", type: "button", onclick: act, title: t(`preset_act.${key}_hint`) }, t(`preset_act.${key}`));
    this.reset = h("button", { class: "small", type: "button", onclick: onReset, title: t("solve.reset_hint") }, t("solve.reset"));
    this.save = button("save", () => this.saveAs());
    this.rename = button("rename", () => this.renameIt());
    this.remove = button("remove", () => this.removeIt());
    this.about = h("p", { class: "muted about", id: "preset-about" });
    this.elements = [
      h("div", { class: "row" }, h("label", { class: "field grow", htmlFor: "preset" }, h("span", {}, t("solve.preset")), this.select), this.reset),
      this.about,
      h("div", { class: "preset-acts" }, this.save, this.rename, this.remove),
    ];
    undoing("preset-save", (name, before, chosen) => this.alter(() => (before ? savePreset(name, before) : removePreset(name)), chosen));
    undoing("preset-rename", (name, old) => this.alter(() => renamePreset(name, old), old));
  }

  /** Show the presets by name, which of them is in use, and whether switches differ from it. */
  show(names, saved, chosen, changed) {
    const options = names.join("\n");
    if (this.options !== options) {
      this.options = options;
      this.select.replaceChildren(...names.map((name) =>
        h("option", { value: name, title: hasText(`preset_help.${name}`) ? t(`preset_help.${name}`) : "" }, presetWords(name))));
    }
    this.saved = saved;
    this.chosen = chosen;
    this.select.value = chosen;
    this.reset.disabled = !changed;
    this.rename.hidden = this.remove.hidden = !saved.includes(chosen);
    this.about.textContent = hasText(`preset_help.${chosen}`) ? t(`preset_help.${chosen}`) : t("preset.own");
  }

  async saveAs() {
    const known = this.saved.includes(this.chosen) ? this.chosen : "";
    const name = await askName(t("preset_act.save_title"), t("take.name"), known, t("message.save"));
    if (name === null) return;
    await attempt(async () => {
      const before = (await getPresets()).find((preset) => preset.name === name);
      await savePreset(name, this.settings());
      showUndo(t("preset.saved", { name }), "preset-save", name, before ?? null, this.chosen);
      await this.onSaved(name);
    });
  }

  async renameIt() {
    const old = this.chosen;
    const name = await askName(t("preset_act.rename_title"), t("take.name"), old, t("preset_act.rename"));
    if (name === null || name === old) return;
    await attempt(async () => {
      await renamePreset(old, name);
      showUndo(t("preset.renamed", { name }), "preset-rename", name, old);
      await this.onSaved(name);
    });
  }

  removeIt() {
    const name = this.chosen;
    return attempt(async () => {
      const { preset, set } = await removePreset(name);
      showUndo(t("preset.removed", { name }), "preset-save", name, { preset, set }, name);
      await this.onSaved("");
    });
  }

  alter(action, name) {
    return attempt(async () => { await action(); await this.onSaved(name); });
  }
}
