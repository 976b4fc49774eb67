// The ruler over the timeline: seconds, frames, or the time of day when it was recorded.
import { clock } from "../base/dom.js";

const KEPT = "timeline-unit";
const UNITS = ["time", "frames", "timecode"];
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800];
const STEPS_FRAMES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 50000];
const APART_PX = 72;
const TIMECODE_HZ = 60;
const HALF_MS = 5e-4;

/** What the ruler counts. */
export const unit = () => (UNITS.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : "time");

/** Have it count something else: the next of what a take has; one without a time of day has no timecode. */
export function nextUnit(timecode) {
  const units = UNITS.filter((name) => name !== "timecode" || timecode);
  localStorage.setItem(KEPT, units[(units.indexOf(unit()) + 1) % units.length]);
}

const two = (number) => String(number).padStart(2, "0");

/** Seconds since midnight of a timecode `hh:mm:ss:ff`. */
function secondsOf(timecode) {
  const [h, m, s, f] = timecode.split(":").map(Number);
  return h * 3600 + m * 60 + s + f / TIMECODE_HZ;
}

/** Return how a frame is written; `timecode`: of the take's first stage time, or "". */
export function frameWords(frame, { rate_hz: rate, begins_s: begins }, timecode) {
  if (unit() === "frames") return String(frame);
  if (unit() === "time" || !timecode) return clock(frame / rate + HALF_MS); // which counts whole tenths
  const total = Math.round((secondsOf(timecode) + begins + frame / rate) * TIMECODE_HZ) % (86400 * TIMECODE_HZ);
  const seconds = Math.floor(total / TIMECODE_HZ);
  return [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60, total % TIMECODE_HZ].map(two).join(":");
}

/** Return the frames at which marks stand, for so many pixels a frame. */
export function ticks({ from, to }, rate, perFrame) {
  const inFrames = unit() === "frames";
  const steps = inFrames ? STEPS_FRAMES : STEPS_S.map((seconds) => seconds * rate);
  const step = steps.find((one) => one * perFrame >= APART_PX) ?? steps[steps.length - 1];
  const found = [];
  for (let k = Math.ceil(from / step); k * step <= to; k += 1) found.push(k * step);
  return found;
}
