// The 3D view: the notice over it, and keys pressed inside it.
import { byId, setText } from "../base/dom.js";

/** Show a sentence over the view, or nothing. */
export function setNotice(text) {
  const notice = byId("notice");
  notice.hidden = !text;
  if (text) setText(notice, text);
}

/** Show over the picture that it is out of date, and grey it; "" if it is current. */
export function setStale(text) {
  byId("viewer").closest(".viewport").classList.toggle("stale", Boolean(text));
  byId("view-tools").inert = Boolean(text);
  setText(byId("curtain"), text);
}

/** Whether a key belongs to a field that is being filled in. */
export const inTextField = (event) => Boolean(event.target.closest?.("input[type=text], input[type=number], input[type=password], input[type=search], textarea, select, [contenteditable]"));

/** Call `use` with the window of the 3D view, also after a reload; not with that of a browser's own page, which is shown while the
 * server is away. */
export function insideView(use) {
  const frame = byId("viewer");
  const loaded = () => { if (frame.contentDocument) use(frame.contentWindow); };
  frame.addEventListener("load", loaded);
  if (frame.contentDocument?.readyState === "complete") loaded();
}

/** Call `handle` with events of a name inside the 3D view. */
export function listenInside(name, handle) {
  insideView((view) => view.addEventListener(name, handle, { capture: true }));
}

/** Call `handle` with keys pressed on the page or inside the 3D view. */
export function onKey(handle) {
  document.addEventListener("keydown", handle);
  listenInside("keydown", handle);
}
