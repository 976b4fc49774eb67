// The 3D view: the layers' checkboxes, the notice over it, and keys pressed inside it.
import { byId, h, setText } from "./dom.js";
import { getView, putLayers } from "./api.js";
import { attempt } from "./messages.js";

/** Draw the checkboxes of the view's layers. Returns the view's state (layers, colours by camera). */
export async function startViewer() {
  const view = await getView();
  const boxes = Object.entries(view.layers).map(([name, layer]) =>
    h("label", { title: `Show or hide: ${layer.label}` },
      h("input", {
        type: "checkbox", name, checked: layer.shown,
        onchange: (event) => attempt(() => putLayers({ [name]: event.target.checked })),
      }),
      layer.label));
  byId("layers").append(...boxes);
  return view;
}

/** Follow what another browser changed. */
export function updateLayers(view) {
  for (const box of byId("layers").querySelectorAll("input")) {
    if (view.layers[box.name]) box.checked = view.layers[box.name].shown;
  }
}

/** Show a sentence over the view, or nothing. */
export function setNotice(text) {
  const notice = byId("notice");
  notice.hidden = !text;
  if (text) setText(notice, text);
}

/** Call `handle` with keys pressed on the page or inside the 3D view. */
export function onKey(handle) {
  document.addEventListener("keydown", handle);
  const frame = byId("viewer");
  const listen = () => frame.contentWindow.addEventListener("keydown", handle);
  frame.addEventListener("load", listen);
  if (frame.contentDocument?.readyState === "complete") listen();
}
