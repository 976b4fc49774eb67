// The edits of the replayed take: the list as the server has it, its changes, undo and redo, and the solve that honours them.
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

/** Whether the replayed solve has the edits as they are. */
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

/** Take in what is replayed, and the stamp of its edits: a list that another browser changed is asked for. */
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

/** The replayed solve is another one by its name. */
export function forgetSolved() {
  state.solve = "";
}

/** Send a change; what is around the playhead is solved and shown with it, then the whole solve is made again. `request` gets the solve that is looked at. */
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

/** Split an edit over a range into two at a stage time within it; what lies between them no longer holds. */
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

/** Take the last change of the edits back. */
export const takeBack = () => send((look) => undoEdits(named(state.take), state.revision, look), t("mend.undone"), false);

/** Make the change that was taken back again; return whether there was one. */
export function makeAgain() {
  if (!state.take || !state.can_redo) return false;
  send((look) => redoEdits(named(state.take), state.revision, look), t("mend.redone"));
  return true;
}

const UNDO = undoing("edits", takeBack, (takeId) => takeId === state.take && state.can_undo);

/** Solve the replayed take again with its edits, what is around the playhead first. */
export async function solveAgain() {
  const { take, solve } = state.replay;
  if (!isSolvedAgain(solve) || await attempt(() => previewEdits(named(take), solve))) solveWhole();
}

/** Solve the whole replayed take again with its edits, or without them beside it. */
export function solveWhole(without = false) {
  const { take, solve } = state.replay, again = isSolvedAgain(solve);
  const name = without ? t("mend.without_name") : again ? solve : INSTEAD;
  return attempt(() => solveTake(named(take), name, { ...(again ? { settings_of: solve } : { preset: INSTEAD }), edits: !without }));
}

/** Have what a first look needs read while a joint is dragged; the look itself says what fails. */
export function expectLook({ take, solve }) {
  if (isSolvedAgain(solve)) readAhead(named(take), solve).catch(() => {});
}

/** Begin; `changed` hears of another list. */
export function startEditList(changed) {
  state.changed = changed;
}
