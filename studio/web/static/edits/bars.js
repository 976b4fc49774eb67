// The edits on the timeline: bars that can be moved, stretched at their ends, and removed; instants are marks.
import { canOperate } from "../base/role.js";
import { t } from "../base/strings.js";
import { add, change, remove } from "./list.js";
import { editList } from "./state.js";
import { secondsOf, stageOf } from "./time.js";
import { wordsOf } from "./words.js";

const GRIP_PX = 6;
const LANES = [
  ["places", "--accent", ["pin", "direction"]], ["contacts", "--good", ["contact"]], ["doubts", "--bad", ["leave_out", "exchange_sides"]], ["layers", "--fair", ["offset", "trim", "retime"]],
];
const FEET = ["left_ankle", "right_ankle"]; // rows of the lane of feet
const state = { dragged: null, chosen: "", drawn: null }; // the edit that is being dragged, with its times; the one that was clicked; the stance that is being drawn

const frameOf = (time_s) => Math.round(secondsOf(time_s) * editList().replay.rate_hz);
const timeOf = (frame) => stageOf(frame / editList().replay.rate_hz);

/** Return the key by which the edits' lanes are redrawn. */
export const barsKey = () => JSON.stringify([editList().revision, editList().take, state.dragged, state.chosen, state.drawn]);

/** Return lanes under the tracks with the edits of the replayed take: spans `[first, last, words, colour, row, edit]`. */
export function editLanes() {
  const { edits, replay } = editList();
  if (!replay.open || !replay.solve) return [];
  return LANES.flatMap(([name, colour, kinds]) => {
    const mine = edits.filter((edit) => kinds.includes(edit.kind)).map((edit) => (state.dragged?.id === edit.id ? state.dragged : edit));
    if (name === "contacts" && state.drawn) mine.push(state.drawn);
    const spans = mine.map((edit) => [frameOf(edit.start_s), frameOf(edit.end_s), wordsOf(edit), edit.on ? edit.id === state.chosen ? "--text" : colour : "--muted", edit.joint?.startsWith("right_") ? 1 : 0, edit]);
    return spans.length ? [{ label: t(`mend.lane.${name}`), colour, rows: name === "contacts" ? 2 : 1, marks: true, spans }] : [];
  });
}

/** Return the edit at a frame in a row of a lane, and where it is grabbed; undefined if there is none. */
function held(lane, row, frame, reach) {
  const here = lane.spans.filter(([first, last, , , , edit]) => edit && first - reach <= frame && frame <= last + reach);
  const [first, last, , , , edit] = here.findLast(([, , , , own]) => own === row) ?? here.at(-1) ?? [];
  if (!edit) return undefined;
  const wide = last - first > 3 * reach;
  return { edit, first, last, end: wide && frame <= first + reach ? "start" : wide && frame >= last - reach ? "end" : "all" };
}

/**
 * Handle Alt on the lane of feet: dragging draws a stance of the left (upper row) or right foot; a click on a detected stance
 * removes it.
 */
function draw(event, { lane, row }, { frameAt, paint }) {
  const begun = frameAt(event), { performer } = editList().replay, canvas = event.currentTarget;
  const common = { kind: "contact", joint: FEET[row], ...(performer && { performer }) };
  const span = (moved) => [begun, frameAt(moved)].sort((a, b) => a - b).map(timeOf);
  const move = (moved) => {
    const [start_s, end_s] = span(moved);
    state.drawn = { ...common, id: "", on: true, touches: "floor", start_s, end_s };
    paint();
  };
  const letGo = async (last) => {
    canvas.removeEventListener("pointermove", move);
    const [start_s, end_s] = span(last), found = lane.spans.some(([from, to, , , own]) => own === row && from <= begun && begun <= to);
    if (start_s < end_s) await add({ ...common, touches: "floor", start_s, end_s });
    else if (found) await add({ ...common, touches: "nothing", start_s, end_s });
    state.drawn = null;
    paint();
  };
  canvas.setPointerCapture(event.pointerId);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", letGo, { once: true });
}

/** Grab an edit on the timeline; return whether there was one. A click selects it and goes there; dragging moves or stretches it. */
export function grab(event, { lane, row }, { frameAt, perFrame, frames, goTo, paint }) {
  if (event.altKey && lane?.feet && canOperate()) {
    draw(event, { lane, row }, { frameAt, paint });
    return true;
  }
  const begun = frameAt(event), found = lane && held(lane, row, begun, GRIP_PX / perFrame);
  if (!found) return false;
  const canvas = event.currentTarget, { edit, first, last, end } = found;
  state.chosen = edit.id;
  const move = (moved) => {
    const by = frameAt(moved) - begun;
    if (!by && !state.dragged) return;
    const limit = (frame) => Math.min(Math.max(frame, 0), frames - 1);
    const from = end === "end" ? first : limit(end === "start" ? Math.min(first + by, last) : first + by);
    const to = end === "start" ? last : limit(end === "end" ? Math.max(last + by, first) : last + by);
    state.dragged = { ...edit, start_s: timeOf(from), end_s: timeOf(to) };
    paint();
  };
  const letGo = async () => {
    canvas.removeEventListener("pointermove", move);
    const { dragged } = state;
    if (!dragged) goTo(first);
    else await change(edit, { start_s: dragged.start_s, end_s: dragged.end_s });
    state.dragged = null;
    paint();
  };
  canvas.setPointerCapture(event.pointerId);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", letGo, { once: true });
  paint();
  return true;
}

/** Remove the edit selected on the timeline; return whether there was one. */
export function removeChosen() {
  const edit = editList().edits.find((one) => one.id === state.chosen);
  if (edit) remove(edit);
  state.chosen = "";
  return Boolean(edit);
}
