// Levels beside the Record button: per camera, how much of what it should give arrives, and how sure it is.
import { byId, h, redraw } from "./dom.js";
import { t } from "./strings.js";

const FULL_FPS = 30;
const GOOD = 0.75, FAIR = 0.4;

/** 0..1: its confidence where it says one, else its frames; nothing where it sees nobody. */
function levelOf(camera) {
  if (!camera.connected || camera.state === "silent") return 0;
  const frames = Math.min(camera.fps / FULL_FPS, 1) * (1 - (camera.loss_percent ?? 0) / 100);
  if (camera.starved === "no_performer") return Math.min(frames, 0.15);
  return camera.confidence === undefined || camera.confidence === null ? frames : Math.min(frames, camera.confidence);
}

const toneOf = (level) => (level >= GOOD ? "good" : level >= FAIR ? "fair" : "bad");

/** Show the levels of a status' cameras in their colours. */
export function updateLevels(cameras, colours) {
  const levels = Object.entries(cameras).sort().map(([name, camera]) => [name, Math.round(levelOf(camera) * 20) / 20, colours[name]]);
  redraw(byId("levels"), levels, () => levels.map(([name, level, colour]) => h("span", {
    class: `level ${toneOf(level)}`, role: "meter", title: t("level.title", { name, percent: Math.round(level * 100) }),
    aria: { label: t("level.label", { name }), valuenow: Math.round(level * 100), valuemin: 0, valuemax: 100 },
  },
  h("span", { class: "swatch", style: `background:${colour ?? "var(--muted)"}` }),
  h("span", { class: "bar-level" }, h("span", { style: `height:${Math.round(level * 100)}%` })))));
}
