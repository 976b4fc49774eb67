// The edits of the replayed take: the list on the server, its changes, undo and redo, and the solve that applies them.
import { addEdit, changeEdit, getEdits, getTakeDetail, previewEdits, readAhead, redoEdits, removeEdit, replaceEdits, solveTake, undoEdits } from "../base/api.js";
import { attempt, keepUndo, showNote, undoing } from "../base/messages.js";
import { hear } from "../base/said.js";
import { t } from "../base/strings.js";
import { UNKNOWN, editList } from "./state.js";
import { wordsOf } from "./words.js";

const NOT_SOLVED_AGAIN = ["", "live", "as-live", "imported", "spliced"]; // these stay as they are: another solve gets the edits
const INSTEAD = "studio";
const isSolvedAgain = (solve) => !NOT_SOLVED_AGAIN.includes(solve);
const state = editList();

const named = (takeId) => ({ session: takeId.slice(0, takeId.indexOf("/")), name: takeId.slice(takeId.indexOf("/") + 1) });

/** Whether the replayed solve has the current edits. */
export const isSolved = () => (state.solved?.edits_revision ?? (state.edits.length ? -1 : state.revision)) === state.revision;

function take(answer, takeId) {
  if (state.take !== takeId || answer.revision < state.revision) return;
  const { revision, edits, can_undo, can_redo, says } = answer;
  Object.assign(state, { revision, edits, can_undo, can_redo, says });
  state.changed();
}

async function load(takeId) {
  const before = state.revision;
  const answer = await attempt(() => getEdits(named(takeId)));
  if (!answer || state.sending) return;
  if (before >= 0 && state.take === takeId && answer.revision > before && answer.can_undo) keepUndo(t("mend.by_other"), UNDO, takeId);
  take(answer, takeId);
}

async function loadSolve(takeId, solve) {
  const found = await attempt(() => getTakeDetail(named(takeId)));
  if (!found || state.take !== takeId) return;
  hear(found.solve_details[solve]?.metrics);
  Object.values(found.solve_details[solve]?.metrics?.edits ?? {}).forEach(hear);
  Object.assign(state, { cameras: found.meta.cameras.map((one) => one.name), solved: found.solve_details[solve]?.metrics ?? null });
  state.changed();
}

/** Handle the current replay and the stamp of its edits: a list changed by another browser is requested. */
export function useEdits(replay, stamp) {
  state.replay = replay;
  const takeId = replay.open ? replay.take : "";
  if (state.take !== takeId) Object.assign(state, { take: takeId, stamp: null, solve: "", ...UNKNOWN, cameras: [], solved: null });
  if (!takeId) return;
  if (stamp !== undefined && state.stamp !== stamp && !state.sending) {
    state.stamp = stamp;
    load(takeId);
  }
  if (state.solve !== replay.solve) {
    state.solve = replay.solve;
    loadSolve(takeId, replay.solve);
  }
}

/** Forget the replayed solve, because a new one has its name. */
export function forgetSolved() {
  state.solve = "";
}

/** Send a change; the frames around the playhead are solved with it and shown, then the whole solve is made again. `request` gets the shown solve. */
async function send(request, words, kept = true) {
  const takeId = state.take;
  state.sending += 1;
  const answer = await attempt(() => request(isSolvedAgain(state.replay.solve) ? state.replay.solve : ""));
  state.sending -= 1;
  if (!answer) {
    state.stamp = null; // somebody else may have changed it
    return undefined;
  }
  take(answer, takeId);
  if (kept) keepUndo(words, UNDO, takeId);
  showNote(words);
  solveWhole();
  return answer;
}

/** Add an edit. */
export const add = (edit) => send((look) => addEdit(named(state.take), edit, state.revision, look), t("mend.added", { what: wordsOf(edit) }));

/** Change some keys of an edit. */
export const change = (edit, keys) => send((look) => changeEdit(named(state.take), edit.id, keys, state.revision, look), t("mend.changed", { what: wordsOf({ ...edit, ...keys }) }));

/** Remove an edit. */
export const remove = (edit) => send((look) => removeEdit(named(state.take), edit.id, state.revision, look), t("mend.removed", { what: wordsOf(edit) }));

/** Split an edit over a range into two at a stage time within it; it no longer applies between them. */
export function split(edit, at_s) {
  const half = 0.5 / state.replay.rate_hz;
  if (at_s - half <= edit.start_s || at_s + half >= edit.end_s) return showNote(t("mend.split_outside"));
  const ids = state.edits.map((one) => one.id);
  let k = state.edits.length + 1;
  while (ids.includes(`${edit.id}-${k}`)) k += 1;
  const second = { ...edit, id: `${edit.id}-${k}`, start_s: Number((at_s + half).toFixed(4)) };
  const edits = state.edits.flatMap((one) => (one.id === edit.id ? [{ ...edit, end_s: Number((at_s - half).toFixed(4)) }, second] : [one]));
  return send((look) => replaceEdits(named(state.take), edits, state.revision, look), t("mend.was_split", { what: wordsOf(edit) }));
}

/** Undo the last change of the edits. */
export const takeBack = () => send((look) => undoEdits(named(state.take), state.revision, look), t("mend.undone"), false);

/** Redo the change that was undone; return whether there was one. */
export function makeAgain() {
  if (!state.take || !state.can_redo) return false;
  send((look) => redoEdits(named(state.take), state.revision, look), t("mend.redone"));
  return true;
}

const UNDO = undoing("edits", takeBack, (takeId) => takeId === state.take && state.can_undo);

/** Solve the replayed take again with its edits, first around the playhead. */
export async function solveAgain() {
  const { take, solve } = state.replay;
  if (!isSolvedAgain(solve) || await attempt(() => previewEdits(named(take), solve))) solveWhole();
}

/** Solve the whole replayed take again with its edits, or without them as an additional solve. */
export function solveWhole(without = false) {
  const { take, solve } = state.replay, again = isSolvedAgain(solve);
  const name = without ? t("mend.without_name") : again ? solve : INSTEAD;
  return attempt(() => solveTake(named(take), name, { ...(again ? { settings_of: solve } : { preset: INSTEAD }), edits: !without }));
}

/** Have the server read the data for a first preview while a joint is dragged; the preview itself reports errors. */
export function expectLook({ take, solve }) {
  if (isSolvedAgain(solve)) readAhead(named(take), solve).catch(() => {});
}

/** Start; `changed` is called when the list changes. */
export function startEditList(changed) {
  state.changed = changed;
}
