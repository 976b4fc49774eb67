// The tables of the compare view: figures of both motions with the better one marked, and joints with their distance.
import { h } from "../base/dom.js";
import { number, t } from "../base/strings.js";

const ALIKE = 0.02; // figures that differ by less are alike

// Key, digits, and the reference's own figure if nearer to that is better; for the rest, less is better. A solve's own
// figures do not depend on the chosen reference; figures against a reference have their own words.
const AGAINST = [
  ["mpjpe_mm", 1], ["mpjpe_root_aligned_mm", 1], ["rms_mm", 1], ["joint_angle_error_deg", 1], ["acceleration_error_m_s2", 1],
  ["absolute_difference_cm", 2], ["shortest_distance_cm", 2], ["latency_ms", 1],
  ["jerk_m_s3", 0, "reference_jerk_m_s3"], ["foot_slide_cm_s", 1, "reference_foot_slide_cm_s"], ["cleanup_events_per_min", 1],
];
const OWN = [["jitter_mm", 2], ["jerk_m_s3", 0], ["own_stance_foot_slide_cm_s", 1], ["bone_length_sd_mm", 1], ["cleanup_events_per_min", 1]];

const shown = (value, digits) => (value === null || value === undefined ? "–" : number(value, digits));

/** Return which of two figures is better, the one nearer to `target`: 0, 1, or -1 if neither is. */
export function better(a, b, target = 0) {
  if ([a, b].some((value) => value === null || value === undefined)) return -1;
  const [left, right] = [Math.abs(a - target), Math.abs(b - target)];
  if (Math.abs(left - right) <= ALIKE * Math.max(left, right)) return -1;
  return left < right ? 0 : 1;
}

/** Return a row; the column of a reference, which has no figures, holds its own value of the figure if there is one. */
function row(words, key, digits, figures, target) {
  const values = figures.map((one) => (one ? shown(one[key], digits) : ""));
  const best = figures[0] && figures[1] ? better(figures[0][key], figures[1][key], target ?? 0) : -1;
  const own = figures.indexOf(null);
  if (own >= 0 && typeof target === "number") values[own] = shown(target, digits);
  return h("tr", {}, h("th", { scope: "row", title: t(`figure.${words}.${key}.hint`) }, t(`figure.${words}.${key}`)),
    values.map((value, side) => h("td", { class: side === best ? "better" : "" }, value,
      side === best && h("span", { class: "sr" }, ` (${t("compare.better")})`))));
}

function group(title, rows) {
  return rows.length ? [h("tr", { class: "group" }, h("th", { colSpan: 3, scope: "rowgroup" }, title)), ...rows] : [];
}

/** Return a table of two motions' figures, each `{own, reference}`, null if a motion has none; `names` head the columns,
 * `reference` is the reference they are measured against. */
export function figureTable(names, figures, reference) {
  const own = figures.map((one) => one?.own ?? null);
  const against = figures.map((one) => one?.reference ?? null);
  const measured = against.find(Boolean);
  const rows = (words, keys, from) => keys.filter(([key]) => from.some((one) => one && one[key] !== null && one[key] !== undefined))
    .map(([key, digits, target]) => row(words, key, digits, from, target && measured[target]));
  return h("table", { class: "figures" },
    h("thead", {}, h("tr", {}, h("td", {}), names.map((name, side) => h("th", { scope: "col", title: name },
      h("span", { class: `swatch side-${side}`, aria: { hidden: "true" } }), h("span", { class: "name" }, name))))),
    h("tbody", {},
      measured ? group(t("compare.against_it", { name: reference }), rows("against", AGAINST, against)) : [],
      group(t("compare.by_itself"), rows("own", OWN, own))));
}

/** Return a table with one row per joint: distance now, mean and largest; a click on a joint calls `choose`. */
export function jointTable(found, chosen, choose) {
  const largest = Math.max(...Object.values(found.per_joint_mm), 1);
  const head = ["compare.joint", "compare.now", "compare.mean", "compare.largest"];
  return h("table", { class: "joints" },
    h("thead", {}, h("tr", {}, head.map((key) => h("th", { scope: "col" }, t(key))))),
    h("tbody", {}, Object.entries(found.per_joint_mm).map(([joint, mean]) => h("tr", { class: joint === chosen ? "chosen" : "" },
      h("th", { scope: "row" }, h("button", { class: "plain", type: "button", onclick: () => choose(joint), aria: { pressed: String(joint === chosen) } }, t(`joint.${joint}`))),
      h("td", { id: `apart-${joint}` }),
      h("td", { class: "share", style: `--share: ${(100 * mean / largest).toFixed(1)}%` }, number(mean)),
      h("td", {}, number(found.per_joint_max_mm[joint]))))));
}

/** Return the rows of what the alignment removed, `[label, value]`. */
export function alignedRows(aligned) {
  const rows = [
    [t("aligned.rotation"), `${number(aligned.rotation_deg, 1)}°`],
    [t("aligned.translation"), `${number(100 * Math.hypot(...aligned.translation_m), 1)} cm`],
    [t("aligned.offset"), `${number(aligned.time_offset_ms, 1)} ms`],
    [t("aligned.drift"), `${number(aligned.clock_drift_ppm)} ppm`],
  ];
  if (aligned.kind === "similarity") rows.push([t("aligned.scale"), number(aligned.scale, 3)]);
  const offsets = Object.values(aligned.marker_offsets_mm ?? {});
  if (offsets.length) rows.push([t("aligned.markers"), t("aligned.markers_mean", { n: offsets.length, mm: number(offsets.reduce((sum, one) => sum + one, 0) / offsets.length) })]);
  return rows;
}
