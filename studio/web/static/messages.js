// The message bar over the 3D view: errors stay until they are dismissed, notes leave by themselves. What a note offers to
// take back, Ctrl+Z takes back too, also when the note has left or the page was loaded again: the last first.
import { byId, h } from "./dom.js";
import { t } from "./strings.js";

const NOTE_MS = 6000;
const KEPT = 50;
const UNDOS = "undos";
const kinds = new Map(); // how acts are taken back, by their kind
const undos = JSON.parse(sessionStorage.getItem(UNDOS) ?? "[]"); // {kind, args} of acts that can be, the last at the end

/** Have acts of a kind taken back by `run`, which gets what `showUndo` was given; return the kind. */
export function undoing(kind, run) {
  kinds.set(kind, run);
  return kind;
}

const keep = () => sessionStorage.setItem(UNDOS, JSON.stringify(undos));

function perform(act) {
  const at = undos.indexOf(act);
  if (at < 0) return undefined; // taken back already
  undos.splice(at, 1);
  keep();
  for (const item of byId("messages").querySelectorAll(".message")) if (item.act === act) item.remove();
  return attempt(() => kinds.get(act.kind)(...act.args));
}

/** Take back the last act that can be on this page; return whether there was one. */
export function undo() {
  const act = undos.findLast(({ kind }) => kinds.has(kind));
  if (act) perform(act);
  return Boolean(act);
}

function show(text, kind, act) {
  const bar = byId("messages");
  for (const old of bar.children) if (old.dataset.text === text) old.remove();
  const close = h("button", { class: "small", type: "button", onclick: () => item.remove() }, t("message.dismiss"));
  const back = act && h("button", { class: "small", type: "button", onclick: () => perform(act) }, t("message.undo"));
  const item = h("div", { class: `message ${kind}`, role: kind === "error" ? "alert" : "status" }, h("p", {}, text), back, close);
  item.dataset.text = text;
  item.act = act;
  bar.append(item);
  if (kind === "note") setTimeout(() => item.remove(), NOTE_MS);
}

/** Show an error until the user dismisses it. */
export const showError = (text) => show(text, "error");

/** Show a note for a few seconds. */
export const showNote = (text) => show(text, "note");

/** Show a note of an act that can be taken back: its kind, and what takes it back needs to know, as JSON has it. */
export function showUndo(text, kind, ...args) {
  const act = { kind, args };
  undos.push(act);
  if (undos.length > KEPT) undos.shift();
  keep();
  show(text, "note", act);
}

/** Run an action; show what it throws. Returns its result, or undefined where it failed. */
export async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    showError(error.message);
    return undefined;
  }
}
