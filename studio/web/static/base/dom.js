// Small helpers for building and updating the page.

/** Return the element with this id. */
export const byId = (id) => document.getElementById(id);

/** Return a new element. `props` are properties, `class`, `data`/`aria` objects or `on<event>` listeners. */
export function h(tag, props = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(props)) {
    if (value === undefined || value === null) continue;
    if (key === "class") element.className = value;
    else if (key === "aria") for (const [name, text] of Object.entries(value)) element.setAttribute(`aria-${name}`, text);
    else if (key.startsWith("on")) element.addEventListener(key.slice(2), value);
    else if (key in element) element[key] = value;
    else element.setAttribute(key, value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

/** Return a new element of a drawing. */
export function svg(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** Set an element's text only where it differs, so that screen readers and selections are left in peace. */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Replace an element's children only where `key` (what they show, as JSON) differs from the last time. */
export function redraw(element, key, build) {
  const shown = JSON.stringify(key);
  if (element.dataset.shown === shown) return;
  const focused = element.contains(document.activeElement) ? document.activeElement.id : "";
  element.dataset.shown = shown;
  element.replaceChildren(...[build()].flat());
  if (focused) byId(focused)?.focus();
}

/** Return a duration [s] as m:ss.d, or mm:ss.d where `wide`. */
export function clock(seconds, wide = false) {
  const tenths = Math.max(0, Math.floor(seconds * 10));
  const minutes = String(Math.floor(tenths / 600)).padStart(wide ? 2 : 1, "0");
  return `${minutes}:${String(Math.floor(tenths / 10) % 60).padStart(2, "0")}.${tenths % 10}`;
}
