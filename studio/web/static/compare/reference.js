// References of a take: another system's motion, uploaded or taken from next to the takes, aligned, shown, measured, removed.
import { byId, h, redraw } from "../base/dom.js";
import { addReference, alignReference, getReference, getReferenceFiles, getReferences, makeReport, removeReference, reportAddress, restoreReference, sendReference } from "../base/api.js";
import { alignedRows } from "./compare_tables.js";
import { ended } from "../base/jobs.js";
import { attempt, showUndo, undoing } from "../base/messages.js";
import { performerWords, several } from "../replay/performers.js";
import { replayed } from "../replay/replay.js";
import { language, number, t } from "../base/strings.js";

const KINDS = ".csv,.bvh,.fbx,.glb,.gltf,.c3d,.trc,.npz,.txt";
const MAX_BYTES = 512 * 1024 * 1024;
const MAX_NAME = 58;
const JOINTS = 21;

/** Return a file name that the server accepts: no path characters, not too long, with its extension. */
export function safeName(name) {
  const dot = name.lastIndexOf(".");
  const [stem, ending] = dot > 0 ? [name.slice(0, dot), name.slice(dot)] : [name, ""];
  const plain = stem.replace(/[^\p{L}\p{N} ._()+-]/gu, "_").replace(/^[ .]+/, "").slice(0, MAX_NAME - ending.length);
  return `${plain || "reference"}${ending.toLowerCase()}`;
}

export class ReferenceSection {
  /** `changed` redraws, `measured` forgets figures, `show(name or null)` shows a reference as the second figure. */
  constructor({ changed, measured, show }) {
    Object.assign(this, { changed, measured, show, names: [], take: "", solve: "", chosen: "", details: null, aligned: null, busy: "", files: null, report: null });
    undoing("reference", (take, name) => attempt(async () => { await restoreReference(take, name); if (take === this.take) await this.load(); }));
  }

  /** Use the references of a take, aligned with a solve. */
  use(take, solve) {
    if (take === this.take && solve === this.solve) return;
    const other = take !== this.take;
    Object.assign(this, { take, solve, aligned: null });
    if (other) {
      Object.assign(this, { names: [], chosen: "", details: null, report: null });
      attempt(() => this.load());
    } else if (this.chosen) this.choose(this.chosen);
  }

  async load() {
    const take = this.take;
    const [names, files] = await Promise.all([getReferences(take), getReferenceFiles()]);
    if (take !== this.take) return;
    Object.assign(this, { names, files });
    if (!names.includes(this.chosen)) this.chosen = "";
    const { ghost } = replayed();
    if (!this.chosen && names.length) await this.choose(names.includes(ghost?.reference) ? ghost.reference : names[0]);
    this.changed();
  }

  async choose(name) {
    Object.assign(this, { chosen: name, details: null, aligned: null });
    const details = await attempt(() => getReference(this.take, name));
    if (this.chosen !== name || !details) return;
    Object.assign(this, { details, aligned: details.aligned_with[this.solve] ?? null });
    this.changed();
  }

  /** Show what is being done during an action; show its error. */
  async during(words, action) {
    this.busy = words;
    this.changed();
    const result = await attempt(action);
    this.busy = "";
    this.changed();
    return result;
  }

  async added(name, find) {
    const found = await this.during(t("reference.reading", { name }), find);
    if (!found) return;
    this.measured();
    this.chosen = found.name;
    await attempt(() => this.load());
    await this.choose(found.name);
    await this.align();
  }

  async send(file) {
    if (!file) return;
    if (file.size > MAX_BYTES) {
      await attempt(() => { throw new Error(t("reference.too_large", { name: file.name, mb: MAX_BYTES >> 20 })); });
      return;
    }
    const name = safeName(file.name);
    await this.added(name, () => sendReference(this.take, name, file));
  }

  takeFile(file) {
    return this.added(file.split("/").pop(), () => addReference(this.take, file));
  }

  /** Align the chosen reference as the fields say, and show it. */
  async align() {
    const how = byId("reference-own-clock")
      ? { align_time: byId("reference-own-clock").checked, align: byId("reference-size").checked ? "similarity" : "rigid", unit_m: Number(byId("reference-unit")?.value) || null, performer: byId("reference-performer")?.value || null }
      : { align_time: true, align: "rigid", unit_m: null, performer: replayed().performer || null };
    const { chosen, solve } = this;
    const found = await this.during(t("reference.aligning"), () => alignReference(this.take, chosen, { solve, ...how }));
    if (!found) return;
    this.measured();
    Object.assign(this, { aligned: found });
    if (this.details) Object.assign(this.details, how);
    this.show(chosen);
    this.changed();
  }

  async remove(name) {
    const take = this.take;
    this.names = this.names.filter((one) => one !== name); // nothing is measured against it from now on
    if (this.chosen === name) Object.assign(this, { chosen: "", details: null, aligned: null });
    if (replayed().ghost?.reference === name) await this.show(null);
    const removed = await attempt(() => removeReference(take, name));
    if (removed) {
      this.measured();
      showUndo(t("reference.removed", { name }), "reference", take, name);
    }
    await attempt(() => this.load());
  }

  async makeReport() {
    const { take, chosen } = this;
    this.report = { share: null };
    this.changed();
    const made = await attempt(async () => {
      const job = await makeReport(take, chosen, language());
      return ended(job, (share) => { this.report = { share }; this.changed(); });
    });
    this.report = made ? { address: reportAddress(take, made.name) } : null;
    this.changed();
  }

  draw() {
    redraw(byId("compare-reference"), [this.take, this.solve, this.names, this.chosen, this.details, this.aligned, this.busy, this.files, this.report, replayed().ghost?.reference], () => this.build());
  }

  build() {
    const add = h("div", { class: "drop", ondragover: (event) => event.preventDefault(), ondrop: (event) => { event.preventDefault(); this.send(event.dataTransfer.files[0]); } },
      h("label", { class: "button small" }, t("reference.add"),
        h("input", { id: "reference-file", class: "sr", type: "file", accept: KINDS, onchange: (event) => { const [file] = event.currentTarget.files; event.currentTarget.value = ""; this.send(file); } })),
      this.files?.length > 0 && h("select", { id: "reference-server", aria: { label: t("reference.from_server") }, onchange: (event) => this.takeFile(event.currentTarget.value) },
        h("option", { value: "" }, t("reference.from_server")), this.files.map((file) => h("option", { value: file }, file))),
      h("p", { class: "muted hint" }, t("reference.kinds")));
    return [
      ...this.names.map((name) => this.row(name)),
      this.busy && h("p", { class: "muted" }, this.busy), this.busy && h("progress", { aria: { label: this.busy } }),
      !this.busy && this.chosen && this.details && this.settings(),
      add,
    ].filter(Boolean);
  }

  row(name) {
    const shown = replayed().ghost?.reference === name;
    return h("div", { class: `reference-row ${name === this.chosen ? "chosen" : ""}` },
      h("button", { class: "plain name", type: "button", title: name, onclick: () => this.choose(name), aria: { pressed: String(name === this.chosen) } }, name),
      h("button", { class: "small", type: "button", aria: { pressed: String(shown), label: t("reference.show", { name }) }, onclick: () => (shown ? this.show(null) : this.show(name)) }, t("reference.ghost")),
      h("button", { class: "small", type: "button", aria: { label: t("reference.remove", { name }) }, onclick: () => this.remove(name) }, t("message.remove")));
  }

  settings() {
    const { details, aligned } = this;
    const check = (id, label, title, checked) => h("label", { class: "check", title }, h("input", { id, type: "checkbox", checked, onchange: () => this.align() }), label);
    return h("div", { class: "reference-settings" },
      check("reference-own-clock", t("reference.own_clock"), t("reference.own_clock_hint"), details.align_time || !Object.keys(details.aligned_with).length),
      check("reference-size", t("reference.size"), t("reference.size_hint"), details.align === "similarity"),
      several(replayed()) && h("label", { class: "field" }, h("span", {}, t("performers.whose")), h("select", { id: "reference-performer", onchange: () => this.align() },
        replayed().performers.map(({ performer, name }, i) => h("option", { value: performer, selected: performer === details.performer || (!details.performer && i === 0) }, performerWords(name))))),
      this.chosen.endsWith(".bvh") && h("label", { class: "field", title: t("reference.unit_hint") }, h("span", {}, t("reference.unit")),
        h("input", { id: "reference-unit", type: "number", min: 0, step: "any", value: details.unit_m ?? "", placeholder: t("reference.unit_by_height"), onchange: () => this.align() })),
      aligned ? this.away(aligned) : h("button", { id: "reference-align", class: "small", type: "button", onclick: () => this.align() }, t("reference.align", { solve: this.solve })),
      this.reportRow());
  }

  away({ aligned, joints, from_s: from, to_s: to }) {
    return h("div", {},
      h("h4", {}, t("aligned.title")),
      h("dl", { class: "away" }, alignedRows(aligned).flatMap(([label, value]) => [h("dt", {}, label), h("dd", {}, value)]),
        h("dt", {}, t("aligned.covers")), h("dd", {}, t("aligned.span", { from: number(Math.max(from, 0), 1), to: number(to, 1), n: joints.length, of: JOINTS }))));
  }

  reportRow() {
    const { report } = this;
    if (report?.address) return h("a", { id: "reference-report", class: "button small primary", href: report.address, target: "_blank", rel: "noopener" }, t("reference.report_open"));
    if (report) return h("progress", { id: "reference-report-progress", max: 1, value: report.share ?? undefined, aria: { label: t("reference.report_making") } });
    return h("button", { id: "reference-report", class: "small", type: "button", title: t("reference.report_hint"), onclick: () => this.makeReport() }, t("reference.report"));
  }
}
