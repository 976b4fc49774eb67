// All performers of a take measured at once: each against their own reference, and identity switches between them.
import { h } from "../base/dom.js";
import { evaluateTogether } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { performerWords, several } from "../replay/performers.js";
import { number, t } from "../base/strings.js";

export class PeopleFigures {
  /** `changed` redraws. */
  constructor(changed) {
    Object.assign(this, { changed, key: "", found: null, busy: false, version: 0 });
  }

  /** Forget the measurements. */
  forget() {
    Object.assign(this, { key: "", found: null, busy: false, version: this.version + 1 });
  }

  async measure(take, solves) {
    const key = JSON.stringify([take, solves]);
    Object.assign(this, { key, found: null, busy: true, version: this.version + 1 });
    this.changed();
    const found = await attempt(() => evaluateTogether(take, solves));
    if (this.key !== key) return;
    Object.assign(this, { found: found ?? null, busy: false, version: this.version + 1 });
    this.changed();
  }

  /** Return the button or, once measured, the figures of these solves; nothing without references or with one performer. */
  build(replay, solves, references) {
    if (!several(replay) || !references.length) return [];
    const fresh = this.key === JSON.stringify([replay.take, solves]);
    if (fresh && this.busy) return [h("progress", { aria: { label: t("compare.measuring") } })];
    if (fresh && this.found) return [this.table(replay, solves)];
    return [h("button", { id: "compare-together", class: "small", type: "button", title: t("together.hint"), onclick: () => this.measure(replay.take, solves) }, t("together.measure"))];
  }

  table({ performers }, solves) {
    const sides = solves.map((solve) => this.found.solves[solve]);
    const row = (name, values, colour) => h("tr", {}, h("th", { scope: "row" },
      colour && h("span", { class: "swatch", style: `background: ${colour}`, aria: { hidden: "true" } }), name), values.map((value) => h("td", {}, value)));
    const percent = (key) => row(t(`together.${key}`), sides.map((one) => `${number(one[`${key}_percent`], 1)} %`));
    const error = (one, key) => (one.performers[key] ? number(one.performers[key].mpjpe_mm, 1) : t("together.no_reference"));
    return h("table", { id: "compare-people", class: "figures" },
      h("thead", {}, h("tr", {}, h("td", {}), solves.map((name, side) => h("th", { scope: "col", title: name },
        h("span", { class: `swatch side-${side}`, aria: { hidden: "true" } }), h("span", { class: "name" }, name))))),
      h("tbody", {},
        h("tr", { class: "group" }, h("th", { colSpan: 3, scope: "rowgroup" }, t("together.mpjpe"))),
        performers.map(({ performer, name, colour }) => row(performerWords(name), sides.map((one) => error(one, performer)), colour)),
        row(t("together.switches"), sides.map((one) => number(one.identity_switches))), percent("missed"), percent("undecided")));
  }
}
