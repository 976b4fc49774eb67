// Small helpers for building and updating the page.
import { own } from "./retell.js";

const WORDS = ["title", "placeholder", "alt", "label"]; // properties that are words
const TYPED = "input[id]:not([type=checkbox], [type=radio], [type=file]), textarea[id]";

/** Return the element with this id. */
export const byId = (id) => document.getElementById(id);

/** Return a new element. `props` are properties, `class`, `data`/`aria` objects or `on<event>` listeners. */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (WORDS.includes(key)) own(element, key, value);
    if (key === "class") element.className = value;
    else if (key === "aria") for (const [name, text] of Object.entries(value)) setWords(element, `aria-${name}`, text);
    else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false).map(nodeOf));
  return element;
}

function setWords(element, name, text) {
  element.setAttribute(name, text);
  own(element, name, text);
}

function nodeOf(child) {
  if (child instanceof Node) return child;
  const node = document.createTextNode(child);
  own(node, "", node.data);
  return node;
}

/** Return a new SVG element. */
export function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Set an element's text only if it differs, so that screen readers and selections are not disturbed. */
export function setText(element, text) {
  const words = text ?? "";
  if (element.textContent !== words) element.replaceChildren(nodeOf(words));
}

const held = { at: null, waiting: new Map() }; // where the pointer is down; what is drawn once it is let go, by element

function letGo() {
  held.at = null;
  if (held.waiting.size) setTimeout(() => [...held.waiting].forEach(([element, draw]) => whenLetGo(element, draw))); // after its click
}
document.addEventListener("pointerdown", (event) => { held.at = event.target; }, true);
for (const name of ["pointerup", "pointercancel"]) document.addEventListener(name, letGo, true);
window.addEventListener("blur", letGo);

/** Call `draw`, which replaces children of an element, once the pointer is not pressed in it: a button replaced meanwhile
 * would get no click. */
export function whenLetGo(element, draw) {
  const waits = held.at && element.contains(held.at);
  if (waits) held.waiting.set(element, draw);
  else {
    held.waiting.delete(element);
    draw();
  }
}

/** Replace an element's children, as `whenLetGo`, only if `key` (what they show, as JSON) or the language has changed since
 * the last time; typed text is kept if only the language has. */
export function redraw(element, key, build) {
  whenLetGo(element, () => drawAnew(element, key, build));
}

function drawAnew(element, key, build) {
  const shown = JSON.stringify(key), { lang } = document.documentElement, before = element.dataset;
  if (before.shown === shown && before.lang === lang) return;
  const focused = element.contains(document.activeElement) ? document.activeElement : null;
  const typed = before.shown === shown ? [...element.querySelectorAll(TYPED)].map(({ id, value }) => [id, value]) : [];
  element.replaceChildren(...[build()].flat());
  Object.assign(element.dataset, { shown, lang }); // once it is built: an error leaves it to be tried again
  for (const [id, value] of typed) if (byId(id)) byId(id).value = value;
  if (focused?.id) byId(focused.id)?.focus();
}

/** Return a duration [s] as m:ss.d, or mm:ss.d if `wide`. */
export function clock(seconds, wide = false) {
  const tenths = Math.max(0, Math.floor(seconds * 10));
  const minutes = String(Math.floor(tenths / 600)).padStart(wide ? 2 : 1, "0");
  return `${minutes}:${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10}`;
}
