// The message bar over the 3D view: errors stay until they are dismissed, notes leave by themselves.
import { byId, h } from "./dom.js";
import { t } from "./strings.js";

const NOTE_MS = 6000;

function show(text, kind, action) {
  const bar = byId("messages");
  for (const old of bar.children) if (old.dataset.text === text) old.remove();
  const close = h("button", { class: "small", type: "button", onclick: () => item.remove() }, t("message.dismiss"));
  const act = action && h("button", { class: "small", type: "button", onclick: () => { item.remove(); action.run(); } }, action.label);
  const item = h("div", { class: `message ${kind}`, role: kind === "error" ? "alert" : "status" }, h("p", {}, text), act, close);
  item.dataset.text = text;
  bar.append(item);
  if (kind === "note") setTimeout(() => item.remove(), NOTE_MS);
}

/** Show an error until the user dismisses it. */
export const showError = (text) => show(text, "error");

/** Show a note for a few seconds; `action`, `{label, run}`, is offered with it. */
export const showNote = (text, action) => show(text, "note", action);

/** Run an action; show what it throws. Returns its result, or undefined where it failed. */
export async function attempt(action) {
  try {
    return await action();
  } catch (error) {
    showError(error.message);
    return undefined;
  }
}
