// The ruler over the timeline: seconds, frames, or the time of day when it was recorded.
import { clock } from "../base/dom.js";
import { number, t } from "../base/strings.js";

const KEPT = "timeline-unit";
const UNITS = ["time", "frames", "timecode"];
const STEPS_S = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 60, 120, 300, 600, 1800];
const STEPS_FRAMES = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 50000];
const APART_PX = 72;
const TIMECODE_HZ = 60;
const HALF_MS = 5e-4;

/** Unit of the ruler. */
export const unit = () => (UNITS.includes(localStorage.getItem(KEPT)) ? localStorage.getItem(KEPT) : "time");

/** Switch to the next unit that a take has; one without a time of day has no timecode. */
export function nextUnit(timecode) {
  const units = UNITS.filter((name) => name !== "timecode" || timecode);
  localStorage.setItem(KEPT, units[(units.indexOf(unit()) + 1) % units.length]);
}

/** Return the hint of the unit's button: for received timecode also its source, drift and bridged parts. */
export function unitWords(timecode) {
  if (!timecode.runs) return t("replay.unit");
  const drift = timecode.drift_ppm === null ? [] : [t("set.drift", { ppm: number(timecode.drift_ppm, 1) })];
  const { length: n } = timecode.bridged_s;
  return [t("replay.unit"), `${timecode.source} ${timecode.rate}`, ...drift, t("replay.bridged", { n })].join(", ");
}

const two = (number) => String(number).padStart(2, "0");

/** Seconds since midnight of a timecode `hh:mm:ss:ff`. */
function secondsOf(timecode) {
  const [h, m, s, f] = timecode.split(":").map(Number);
  return h * 3600 + m * 60 + s + f / TIMECODE_HZ;
}

/** Return the frame number since midnight of received timecode, at a stage time [s]. */
function numberAt(timecode, time) {
  const [begin, first] = timecode.runs.filter(([at]) => at <= time).at(-1) ?? timecode.runs[0];
  return Math.floor(first + (time - begin) * timecode.fps * (1 + (timecode.drift_ppm ?? 0) * 1e-6) + 0.1);
}

/** Frame number since midnight as `hh:mm:ss:ff`; drop-frame skips the first numbers of each minute except every tenth. */
function timecodeWords({ count, drop }, frame) {
  const left = drop ? count / 15 : 0, minute = 60 * count - left, ten = 10 * minute + left;
  const day = 144 * ten, at = ((frame % day) + day) % day;
  const within = at % ten, tens = Math.floor(at / ten);
  const minutes = within < 60 * count ? 0 : 1 + Math.floor((within - 60 * count) / minute);
  const total = at + left * (9 * tens + minutes);
  const seconds = Math.floor(total / count);
  const head = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60].map(two).join(":");
  return `${head}${drop ? ";" : ":"}${two(total % count)}`;
}

/** Bridged parts of timecode as frames of a solve, begin and end. */
export const bridgedFrames = ({ rate_hz: rate, begins_s: begins }, timecode) =>
  (timecode.bridged_s ?? []).map((span) => span.map((time) => (time - begins) * rate));

/** Return a frame in words; `timecode`: as received, or of the take's first stage time, or "". */
export function frameWords(frame, { rate_hz: rate, begins_s: begins }, timecode) {
  if (unit() === "frames") return String(frame);
  if (unit() === "time" || !timecode) return clock(frame / rate + HALF_MS); // which counts whole tenths
  if (timecode.runs) return timecodeWords(timecode, numberAt(timecode, begins + frame / rate));
  const total = Math.round((secondsOf(timecode) + begins + frame / rate) * TIMECODE_HZ) % (86400 * TIMECODE_HZ);
  const seconds = Math.floor(total / TIMECODE_HZ);
  return [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60, total % TIMECODE_HZ].map(two).join(":");
}

/** Return the frames with tick marks; `perFrame`: pixels per frame. */
export function ticks({ from, to }, rate, perFrame) {
  const inFrames = unit() === "frames";
  const steps = inFrames ? STEPS_FRAMES : STEPS_S.map((seconds) => seconds * rate);
  const step = steps.find((one) => one * perFrame >= APART_PX) ?? steps[steps.length - 1];
  const found = [];
  for (let k = Math.ceil(from / step); k * step <= to; k += 1) found.push(k * step);
  return found;
}
