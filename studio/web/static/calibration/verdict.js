// Result of a calibration per camera: verdict, distance of its joints to the reference camera's, and reasons with advice.
import { h } from "../base/dom.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

/** Split a reason of the server: what is wrong, and after a colon what to do. */
export function adviceOf(reason) {
  const colon = /\s?: /.exec(reason);
  return colon ? [reason.slice(0, colon.index), reason.slice(colon.index + colon[0].length)] : [reason, ""];
}

/** Return all cameras' reasons: `[camera, what is wrong, what to do]`. */
export const reasonsOf = (cameras) => Object.entries(cameras).flatMap(([name, camera]) => camera.reasons.map((reason) => [name, ...adviceOf(said(reason))]));

/** Return the distance of a camera's joints to the reference camera's in the walk; a camera refused at once has no figure. */
function residualOf({ residual_median_mm: median, residual_p95_mm: p95 }, isReference) {
  if (isReference && !median) return t("camera.reference");
  return typeof median === "number" ? t("wizard.residual", { median: number(median), p95: number(p95) }) : "–";
}

/** Return a card for each camera; `colours`: by camera. */
export function verdictCards(cameras, reference, colours = {}) {
  const reasons = reasonsOf(cameras);
  return Object.entries(cameras).sort().map(([name, camera]) => h("li", { class: "wizard-card verdict" },
    h("span", { class: "swatch", style: `background:${colours[name] ?? "var(--muted)"}` }), h("strong", {}, name),
    h("span", { class: { good: "good", usable: "fair", refused: "bad" }[camera.verdict] }, t(`calibration.verdict.${camera.verdict}`)),
    h("span", { class: "figure" }, residualOf(camera, name === reference)),
    reasons.filter(([of]) => of === name).map(([, why, what]) => h("p", {}, why, what && h("b", {}, what)))));
}
