// The message bar: errors stay until they are dismissed, notes disappear by themselves. The Undo button and Ctrl+Z undo
// the same acts as the notes offer to, last first, also after the note has disappeared or the page was reloaded. The
// button says what it undoes.
import { byId, h } from "./dom.js";
import { t } from "./strings.js";

const NOTE_MS = 6000;
const KEPT = 50;
const UNDOS = "undos";
const bar = byId("messages"), home = document.createComment("where the messages are");
const phone = matchMedia("(max-width: 800px)"); // as studio.css has it
const kinds = new Map(); // {run, fits} by kind of act
const undos = JSON.parse(sessionStorage.getItem(UNDOS) ?? "[]"); // {kind, args, text} of acts that can be, the last at the end

/** Move the bar to where the user looks: into the open dialog, else to its place in the page, on a phone to the page's end. */
function settle() {
  const dialog = [...document.querySelectorAll("dialog[open]")].at(-1);
  if (dialog) {
    if (bar.parentElement !== dialog) dialog.prepend(bar);
  } else if (phone.matches) {
    if (document.body.lastElementChild !== bar) document.body.append(bar);
  } else if (home.nextSibling !== bar) {
    home.after(bar);
  }
}

/** Keep an element above the messages. */
export const pin = (element) => bar.prepend(element);

/** Register how acts of a kind are undone: `run` gets the arguments given to `showUndo`; `fits` gets them too and says whether
 * that is possible now. Return the kind. */
export function undoing(kind, run, fits = () => true) {
  kinds.set(kind, { run, fits });
  showNext();
  return kind;
}

/** Return the act that is undone next, if there is one. */
const next = () => undos.findLast(({ kind, args }) => kinds.get(kind)?.fits(...args));

/** Show on the button what it undoes. */
export function showNext() {
  const button = byId("undo"), act = next();
  if (!button) return; // the page has none
  const words = act ? t("message.undo_what", { what: act.text }) : t("message.undo_nothing");
  button.disabled = !act;
  button.title = words;
  button.setAttribute("aria-label", words);
}

function keep() {
  sessionStorage.setItem(UNDOS, JSON.stringify(undos));
  showNext();
}

/** Keep an act that can be undone, without a note: what it did, its kind, and the arguments for undoing it, as JSON values. */
export function keepUndo(text, kind, ...args) {
  const act = { kind, args, text };
  undos.push(act);
  if (undos.length > KEPT) undos.shift();
  keep();
  return act;
}

function perform(act) {
  const at = undos.indexOf(act);
  if (at < 0) return undefined; // taken back already
  undos.splice(at, 1);
  keep();
  for (const item of bar.querySelectorAll(".message")) if (item.act === act) item.remove();
  return attempt(() => kinds.get(act.kind).run(...act.args));
}

/** Undo the last act that can be undone on this page, and say which; return whether there was one. */
export function undo() {
  const act = next();
  if (act) perform(act);
  if (act?.text) showNote(t("message.undone", { what: act.text }));
  return Boolean(act);
}

function show(text, kind, act) {
  settle();
  for (const old of bar.children) if (old.dataset.text === text) old.remove();
  const close = h("button", { class: "small", type: "button", onclick: () => item.remove() }, t("message.dismiss"));
  const back = act && h("button", { class: "small", type: "button", onclick: () => perform(act) }, t("message.undo"));
  const item = h("div", { class: `message ${kind}`, role: kind === "error" ? "alert" : "status" }, h("p", {}, text), back, close);
  item.dataset.text = text;
  item.act = act;
  bar.append(item);
  if (kind === "note") setTimeout(() => item.remove(), NOTE_MS);
}

/** Forget an act that had no effect. */
export function dropUndo(act) {
  const at = undos.indexOf(act);
  if (at >= 0) undos.splice(at, 1);
  keep();
}

/** Show an error until the user dismisses it. */
export const showError = (text) => show(text, "error");

/** Show a note for a few seconds. */
export const showNote = (text) => show(text, "note");

/** Show a note of an act that can be undone; see `keepUndo`. */
export const showUndo = (text, kind, ...args) => show(text, "note", keepUndo(text, kind, ...args));

/** Run an action; show its error, or a note if it was cancelled, while `isWanted`. Returns its result, or undefined if it failed. */
export async function attempt(action, isWanted = () => true) {
  try {
    return await action();
  } catch (error) {
    if (!isWanted()) return undefined;
    if (error.name === "AbortError") showNote(error.message);
    else showError(error.message);
    return undefined;
  }
}

new MutationObserver(settle).observe(document.body, { subtree: true, attributes: true, attributeFilter: ["open"] });
new MutationObserver(settle).observe(document.body, { childList: true }); // a dialog that goes leaves the bar to the page
phone.addEventListener("change", settle);
bar.before(home);
settle();
byId("undo")?.addEventListener("click", undo);
showNext();
