// The message bar over the 3D view: errors stay until they are dismissed, notes leave by themselves. What a note offers to
// take back, Ctrl+Z takes back too, also when the note has left: the last first.
import { byId, h } from "./dom.js";
import { t } from "./strings.js";

const NOTE_MS = 6000;
const KEPT = 50;
const undos = [];

function perform(action) {
  const at = undos.indexOf(action);
  if (at >= 0) undos.splice(at, 1);
  for (const item of byId("messages").querySelectorAll(".message")) if (item.action === action) item.remove();
  return action.run();
}

/** Take back the last act that can be; return whether there was one. */
export function undo() {
  const action = undos.at(-1);
  if (action) perform(action);
  return Boolean(action);
}

function show(text, kind, action) {
  const bar = byId("messages");
  for (const old of bar.children) if (old.dataset.text === text) old.remove();
  const close = h("button", { class: "small", type: "button", onclick: () => item.remove() }, t("message.dismiss"));
  const act = action && h("button", { class: "small", type: "button", onclick: () => perform(action) }, action.label);
  const item = h("div", { class: `message ${kind}`, role: kind === "error" ? "alert" : "status" }, h("p", {}, text), act, close);
  item.dataset.text = text;
  item.action = action;
  bar.append(item);
  if (kind === "note") setTimeout(() => item.remove(), NOTE_MS);
}

/** Show an error until the user dismisses it. */
export const showError = (text) => show(text, "error");

/** Show a note for a few seconds. */
export const showNote = (text, action) => {
  if (action) undos.push(action);
  if (undos.length > KEPT) undos.shift();
  show(text, "note", action);
};

/** Show a note of an act that `run` takes back. */
export const showUndo = (text, run) => showNote(text, { label: t("message.undo"), run });

/** Run an action; show what it throws. Returns its result, or undefined where it failed. */
export async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    showError(error.message);
    return undefined;
  }
}
