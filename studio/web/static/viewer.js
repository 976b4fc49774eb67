// The 3D view: the layers' checkboxes, the notice over it, and keys pressed inside it.
import { byId, h, setText } from "./dom.js";
import { putLayers } from "./api.js";
import { attempt } from "./messages.js";
import { serverText, t } from "./strings.js";

/** Show a checkbox per layer of the view. */
export function showLayers(layers) {
  for (const label of byId("layers").querySelectorAll("label")) label.remove();
  const labelOf = (name, layer) => serverText(`layer.${name}`, layer.label);
  byId("layers").append(...Object.entries(layers).map(([name, layer]) =>
    h("label", { title: t("stage.layer_hint", { layer: labelOf(name, layer) }) },
      h("input", {
        type: "checkbox", name, checked: layer.shown,
        onchange: (event) => attempt(() => putLayers({ [name]: event.target.checked })),
      }),
      labelOf(name, layer))));
}

/** Show a sentence over the view, or nothing. */
export function setNotice(text) {
  const notice = byId("notice");
  notice.hidden = !text;
  if (text) setText(notice, text);
}

/** Whether a key belongs to a field that is being filled in. */
export const inTextField = (event) => Boolean(event.target.closest?.("input[type=text], input[type=number], input[type=password], input[type=search], textarea, select, [contenteditable]"));

/** Call `handle` with keys pressed on the page or inside the 3D view. */
export function onKey(handle) {
  document.addEventListener("keydown", handle);
  const frame = byId("viewer");
  const listen = () => frame.contentWindow.addEventListener("keydown", handle);
  frame.addEventListener("load", listen);
  if (frame.contentDocument?.readyState === "complete") listen();
}
