// The calibration panel: what is in use, the Calibrate button, its progress and verdict.
import { byId, h, redraw, setText } from "../base/dom.js";
import { finishCalibration } from "../base/api.js";
import { coverageMap, coverageShare } from "./coverage.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";
import { openWizard } from "./wizard.js";

const TONES = { good: "good", usable: "fair", refused: "bad" };
const BUSY = ["gathering", "computing"];

function mm(value) {
  return value === null || value === undefined ? "–" : `${number(value)} mm`;
}

function table(cameras, colours, reference) {
  const rows = Object.entries(cameras).sort().map(([name, camera]) => h("tr", {},
    h("td", {}, h("span", { class: "row" },
      h("span", { class: "swatch", style: `background:${colours[name] ?? "var(--muted)"}`, aria: { hidden: "true" } }), name)),
    h("td", { class: "num" }, name === reference ? t("camera.reference") : mm(camera.residual_median_mm)),
    h("td", { class: `num ${TONES[camera.verdict] ?? ""}` }, t(`calibration.verdict.${camera.verdict}`))));
  return h("table", {},
    h("thead", {}, h("tr", {}, h("th", { scope: "col" }, t("calibration.camera")),
      h("th", { scope: "col", class: "num", title: t("calibration.disagreement_hint") }, t("calibration.disagreement")),
      h("th", { scope: "col", class: "num" }, t("calibration.verdict")))),
    h("tbody", {}, rows));
}

function coverage(cameras, colours) {
  return Object.entries(cameras).filter(([, { cells }]) => cells.length > 0).map(([name, seen]) => h("div", { class: "coverage" },
    coverageMap(seen, colours[name] ?? "var(--accent)", t("calibration.coverage", { name, points: seen.points, n: seen.cells.length })),
    h("span", { class: seen.enough ? "good" : "muted" }, `${name}: ${seen.enough ? t("wizard.map_enough") : `${number(100 * coverageShare(seen))} %`}`)));
}

function reasons(cameras) {
  const list = Object.entries(cameras).flatMap(([name, camera]) => camera.reasons.map((reason) => `${name}: ${said(reason)}`));
  return list.length ? h("ul", { class: "reasons" }, list.map((reason) => h("li", {}, reason))) : null;
}

function steps(progress) {
  const left = Math.max(0, Math.ceil(progress.seconds * (1 - progress.progress / 0.9)));
  if (progress.state === "computing") return t("calibration.computing");
  return progress.seconds - left < 4 ? t("calibration.t_pose") : t("calibration.walk", { left });
}

function build(state, colours, ready) {
  const progress = state.attempt;
  const busy = BUSY.includes(progress.state);
  const parts = [];
  if (busy) {
    parts.push(h("p", { id: "calibration-step", role: "status" }, steps(progress)),
      h("progress", { id: "calibration-progress", max: 1, value: progress.progress, aria: { label: t("calibration.progress") } }));
    parts.push(h("div", { id: "coverage", class: "row" }));
  } else if (progress.state === "failed") {
    parts.push(h("p", { class: "bad", role: "status" }, said(progress.message)));
  }
  if (!busy && state.state !== "good") {
    parts.push(h("p", { class: "empty" }, t("calibration.how")));
  }
  if (state.warnings.length) {
    parts.push(h("ul", { class: "reasons", role: "alert" }, state.warnings.map((text) => h("li", { class: "fair" }, said(text)))));
  }
  if (!busy && state.state !== "none") parts.push(table(state.cameras, colours, state.reference), reasons(state.cameras));
  parts.push(h("div", { class: "row" },
    h("button", {
      id: "calibrate", type: "button", class: state.state === "good" ? "" : "primary", disabled: !ready,
      onclick: openWizard, title: t("wizard.open_hint"),
    }, t(busy ? "calibration.busy" : "calibration.start")),
    progress.state === "gathering" && h("button", {
      type: "button", onclick: () => attempt(finishCalibration), title: t("calibration.enough_hint"),
    }, t("calibration.enough")),
    state.height_m && h("span", { class: "muted" }, t("calibration.performer", { height: number(state.height_m, 2) }))));
  return h("div", { class: "stack" }, parts.filter(Boolean));
}

function badge(state, busy, stale) {
  if (stale) return ["unknown", "muted"];
  if (busy) return ["calibrating", "fair"];
  if (state.state === "none") return ["none", "muted"];
  if (state.state === "provisional") return ["provisional", "fair"];
  if (state.warnings.length) return ["look", "fair"];
  const verdicts = Object.values(state.cameras).map((camera) => camera.verdict);
  return verdicts.every((verdict) => verdict === "good") ? ["good", "good"] : ["usable", "fair"];
}

/** Show the calibration of a status; `ready`: whether a camera is connected. */
export function updateCalibration({ calibration: state, stale }, colours, ready) {
  const busy = BUSY.includes(state.attempt.state);
  const [words, tone] = badge(state, busy, stale);
  const mark = byId("calibration-badge");
  setText(mark, t(`calibration.badge.${words}`));
  mark.className = `badge ${tone}`;
  const { progress } = state.attempt;
  const still = { ...state, attempt: { ...state.attempt, progress: 0, frames: 0, coverage: 0, estimates: 0 }, tpose: null, age_s: 0 };
  redraw(byId("calibration"), [still, colours, ready], () => [build(state, colours, ready)]);
  if (busy && byId("calibration-progress")) {
    byId("calibration-progress").value = progress;
    setText(byId("calibration-step"), stale ? t("stale.unknown") : steps(state.attempt));
    redraw(byId("coverage"), state.attempt.coverage, () => coverage(state.attempt.coverage, colours));
  }
}
