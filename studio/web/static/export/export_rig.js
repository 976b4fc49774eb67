// Exports onto the user's rig: choose or upload one, check the mapping of its bones, and correct it.
import { h } from "../base/dom.js";
import { getRigMapping, getRigs, putRigMapping, sendRig } from "../base/api.js";
import { attempt, showNote } from "../base/messages.js";
import { safeName } from "../compare/reference.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const KINDS = ".glb,.fbx,.bvh";
const FINGER = /Hand(Thumb|Index|Middle|Ring|Pinky)/;

export class RigChoice {
  /** `changed` is called when another rig was chosen, or its mapping was read or corrected. */
  constructor(changed) {
    Object.assign(this, { changed, rigs: [], name: "", facts: null, busy: "", element: h("div", { class: "rig" }) });
  }

  /** Whether an export onto the rig can start. */
  get ready() {
    return Boolean(this.facts && !this.facts.problem);
  }

  async open(wanted) {
    this.rigs = (await attempt(getRigs)) ?? [];
    await this.choose(this.rigs.includes(wanted) ? wanted : (this.rigs[0] ?? ""));
  }

  async during(words, action) {
    this.busy = words;
    this.draw();
    const result = await attempt(action);
    this.busy = "";
    return result;
  }

  async choose(name) {
    Object.assign(this, { name, facts: null });
    if (name) this.facts = (await this.during(t("rig.reading", { name }), () => getRigMapping(name))) ?? null;
    this.draw();
    this.changed();
  }

  async send(file) {
    if (!file) return;
    const name = safeName(file.name);
    const facts = await this.during(t("rig.reading", { name }), () => sendRig(name, file));
    if (facts) {
      this.rigs = (await attempt(getRigs)) ?? [];
      Object.assign(this, { name, facts });
    }
    this.draw();
    this.changed();
  }

  async correct(role, bone) {
    const bones = { ...this.facts.bones, [role]: bone || null };
    const facts = await this.during(t("rig.saving"), () => putRigMapping(this.name, bones));
    if (facts) {
      this.facts = facts;
      showNote(t("rig.saved"));
    }
    this.draw();
    this.changed();
  }

  draw() {
    const opened = this.element.querySelector("details")?.open;
    this.element.replaceChildren(...[
      h("div", { class: "rig-row" },
        h("select", { id: "export-rig", disabled: !this.rigs.length, aria: { label: t("rig.which") }, onchange: (event) => this.choose(event.currentTarget.value) },
          this.rigs.length ? this.rigs.map((name) => h("option", { value: name, selected: name === this.name }, name)) : h("option", {}, t("rig.none"))),
        h("label", { class: "button" }, t("rig.add"),
          h("input", { id: "export-rig-file", class: "sr", type: "file", accept: KINDS, onchange: (event) => { const [file] = event.currentTarget.files; event.currentTarget.value = ""; this.send(file); } }))),
      this.busy && h("p", { class: "muted" }, this.busy), this.busy && h("progress", { aria: { label: this.busy } }),
      !this.busy && !this.rigs.length && h("p", { class: "muted hint" }, t("rig.kinds")),
      !this.busy && this.facts && this.words(),
      !this.busy && this.facts && this.table(opened || Boolean(this.facts.problem)),
    ].filter(Boolean));
  }

  words() {
    const { facts } = this;
    if (facts.problem) return h("p", { class: "bad" }, said(facts.problem));
    const found = Object.values(facts.bones).filter(Boolean).length;
    return h("p", { class: "muted hint" }, t("rig.facts", { height: number(facts.height_m, 2), n: found, bones: facts.bone_count }));
  }

  table(open) {
    const { facts } = this;
    const names = [...new Set([...Object.values(facts.bones).filter(Boolean), ...facts.unmapped])].sort();
    const row = ([role, bone]) => h("tr", {}, h("th", { scope: "row" }, role), h("td", {},
      h("select", { aria: { label: t("rig.bone_of", { role }) }, onchange: (event) => this.correct(role, event.currentTarget.value) },
        h("option", { value: "" }, t("rig.no_bone")), names.map((name) => h("option", { value: name, selected: name === bone }, name)))));
    const roles = Object.entries(facts.bones);
    return h("details", { class: "mapping", open: Boolean(open) }, h("summary", {}, t("rig.mapping")),
      h("table", {}, h("tbody", {}, roles.filter(([role]) => !FINGER.test(role)).map(row))),
      h("details", {}, h("summary", {}, t("rig.fingers")), h("table", {}, h("tbody", {}, roles.filter(([role]) => FINGER.test(role)).map(row)))));
  }
}
