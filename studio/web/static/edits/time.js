// Conversion between the replayed solve's time and stage time: they differ where its edits retime parts.
import { editList } from "./state.js";

const STEP_S = 0.005;
const kept = { key: "", stage: [], solve: [] };

const eased = (part) => { const t = Math.min(Math.max(part, 0), 1); return t * t * (3 - 2 * t); };

/** Return the weight of a retimed part at a stage time, 0..1. */
function share({ start_s: start, end_s: end, ease_s: ease }, time_s) {
  const away = Math.max(start - time_s, time_s - end, 0);
  return ease > 0 ? eased(1 - away / ease) : Number(away === 0);
}

/** Return stage times and the solve's times for them, as in `studio/engine/edits/time_map.py`. */
function table(retimed) {
  const key = JSON.stringify(retimed);
  if (kept.key === key) return kept;
  const begin = Math.min(...retimed.map((one) => one.start_s - one.ease_s)), end = Math.max(...retimed.map((one) => one.end_s + one.ease_s));
  const count = Math.max(2, Math.round((end - begin) / STEP_S) + 1), step = (end - begin) / (count - 1);
  const stage = Array.from({ length: count }, (_, k) => begin + k * step);
  const pace = stage.map((time_s) => retimed.reduce((product, one) => product * (1 + (one.factor - 1) * share(one, time_s)), 1));
  const solve = [begin];
  for (let k = 1; k < count; k += 1) solve.push(solve[k - 1] + 0.5 * step * (pace[k] + pace[k - 1]));
  return Object.assign(kept, { key, stage, solve });
}

function mapped(time_s, from, to) {
  const last = from.length - 1;
  if (time_s <= from[0]) return time_s - from[0] + to[0];
  if (time_s >= from[last]) return time_s - from[last] + to[last];
  const k = from.findIndex((one) => one > time_s);
  return to[k - 1] + ((time_s - from[k - 1]) / (from[k] - from[k - 1])) * (to[k] - to[k - 1]);
}

const between = (time_s, forth) => {
  const retimed = editList().solved?.retimed ?? [];
  if (!retimed.length) return time_s;
  const { stage, solve } = table(retimed);
  return forth ? mapped(time_s, stage, solve) : mapped(time_s, solve, stage);
};

/** Return the seconds since the beginning of the replayed solve for a stage time. */
export const secondsOf = (stage_s) => between(stage_s, true) - editList().replay.begins_s;

/** Return the stage time that many seconds after the beginning of the replayed solve. */
export const stageOf = (seconds) => Number(between(editList().replay.begins_s + seconds, false).toFixed(4));
