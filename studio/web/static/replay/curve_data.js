// Values of the chosen curves: thinned over the whole take, and as fine as needed over the part that the timeline shows.
import { getJointCurves } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { chosenCurves } from "./curve_choice.js";
import { indexAt } from "./curves.js";
import { shownPart } from "./zoom.js";

const POINTS = 3000;
const AROUND = 0.5; // of what is shown, loaded on both sides too
const FINER = 0.4; // a part that is thinned is loaded anew once less of it is shown

const state = { of: "", version: 0, whole: null, part: null, exact: null, asking: false, failed: "", changed: () => {} };

const nameOf = ({ joint, channel }) => `${joint}.${channel}`;

function take(answer) {
  return { first: answer.first, last: answer.last, whole: answer.whole, byName: new Map(answer.curves.map((curve) => [nameOf(curve), curve])) };
}

/** Return the next request: the whole, a finer part, or the one frame under the playhead; or null. */
function next(replay, frame) {
  const { whole, part, exact } = state, end = replay.frames - 1;
  if (!whole) return { into: "whole", first: 0, last: end };
  if (whole.whole) return null;
  const { from, to } = shownPart(replay), span = to - from;
  const covered = part && part.first <= from && to <= part.last;
  const coarse = covered && !part.whole && span < FINER * (part.last - part.first);
  if (span < FINER * end && (!covered || coarse)) {
    return { into: "part", first: Math.max(0, Math.floor(from - AROUND * span)), last: Math.min(end, Math.ceil(to + AROUND * span)) };
  }
  const known = part?.whole && part.first <= frame && frame <= part.last;
  return replay.playing || known || exact?.first === frame ? null : { into: "exact", first: frame, last: frame };
}

async function ask(replay, frame) {
  const wanted = state.asking || state.failed === state.of ? null : next(replay, frame);
  if (!wanted) return;
  const { of } = state;
  state.asking = true;
  const answer = await attempt(() => getJointCurves(chosenCurves().map(nameOf), wanted.first, wanted.last, POINTS));
  state.asking = false;
  if (!answer) state.failed = of; // said once, and not asked for again
  if (answer && of === state.of) state[wanted.into] = take(answer);
  if (answer) state.changed();
}

/** Drop values of another choice or replay, and request what is needed and not known. */
export function loadCurveData(replay, frame) {
  const of = JSON.stringify([replay.take, replay.solve, replay.performer, replay.ghost, replay.ghost_offset_ms, chosenCurves().map(nameOf), state.version]);
  if (state.of !== of) Object.assign(state, { of, whole: null, part: null, exact: null });
  if (replay.solve && chosenCurves().length) ask(replay, frame);
}

/** Forget the values: the solve was replaced by one of the same name. */
export function forgetCurveData() {
  state.version += 1;
}

/** Key of the known values, which changes when they do. */
export const curveDataKey = () => `${state.of} ${state.whole?.last} ${state.part?.first} ${state.part?.last}`;

/** Return a curve's frames and values for a part of the take, or null if none are known yet. */
export function curveIn(curve, { from, to }) {
  const { whole, part } = state;
  const fits = part && part.first <= from && to <= part.last;
  return (fits ? part : whole)?.byName.get(nameOf(curve)) ?? null;
}

/** Return a curve's value at a frame: `{value, near, unit, order}`; `near`: it is of the nearest known frame. Null: not known yet. */
export function curveValue(curve, frame) {
  const inside = (data) => data && data.first <= frame && frame <= data.last;
  const source = [state.exact, state.part, state.whole].find(inside)?.byName.get(nameOf(curve));
  if (!source) return null;
  const at = indexAt(source.frames, frame);
  return { value: source.values[at], near: source.frames[at] !== frame, unit: source.unit, order: source.order };
}

/** Start; `changed` is called on new values. */
export function startCurveData(changed) {
  state.changed = changed;
}
