// Levels next to the Record button: per camera, the share of expected frames that arrive, and its confidence.
import { byId, h, redraw } from "../base/dom.js";
import { t } from "../base/strings.js";

const FULL_FPS = 30;
const GOOD = 0.75, FAIR = 0.4;

/** Return the level 0..1: the lower of frame share and reported confidence; at most 0.15 without a performer; null if unknown. */
function levelOf(camera) {
  if (camera.state === "unknown") return null;
  if (!camera.connected || camera.state === "silent") return 0;
  const frames = Math.min(camera.fps / FULL_FPS, 1) * (1 - (camera.loss_percent ?? 0) / 100);
  if (camera.limited_by === "no_performer") return Math.min(frames, 0.15);
  return camera.confidence === undefined || camera.confidence === null ? frames : Math.min(frames, camera.confidence);
}

const toneOf = (level) => (level === null ? "muted" : level >= GOOD ? "good" : level >= FAIR ? "fair" : "bad");

const rounded = (level) => (level === null ? null : Math.round(level * 20) / 20);

/** Show the levels of a status's cameras in their colours. */
export function updateLevels(cameras, colours) {
  const levels = Object.entries(cameras).sort().map(([name, camera]) => [name, rounded(levelOf(camera)), colours[name]]);
  redraw(byId("levels"), levels, () => levels.map(([name, level, colour]) => h("span", {
    class: `level ${toneOf(level)}`, role: "meter", title: level === null ? t("level.unknown", { name }) : t("level.title", { name, percent: Math.round(level * 100) }),
    aria: { label: t("level.label", { name }), valuenow: Math.round(level * 100), valuemin: 0, valuemax: 100 },
  },
  h("span", { class: "swatch", style: `background:${colour ?? "var(--muted)"}` }),
  h("span", { class: "bar-level" }, h("span", { style: `height:${Math.round(level * 100)}%` })))));
}
