// Small dialogs: confirmation, entering a name, a text to read.
import { h } from "./dom.js";
import { t } from "./strings.js";

/** Show a dialog with a form; return the result of `answer` once it is submitted, or null if it is closed. */
export function ask(title, content, act, danger, answer) {
  return new Promise((resolve) => {
    let result = null;
    const dialog = h("dialog", { class: "ask", aria: { label: title }, onclose: () => { dialog.remove(); resolve(result); } },
      h("h2", {}, title),
      h("form", { class: "stack", onsubmit: (event) => { event.preventDefault(); result = answer(); dialog.close(); } },
        content,
        h("div", { class: "buttons" },
          h("button", { type: "submit", class: danger ? "danger" : "primary" }, act),
          h("button", { type: "button", onclick: () => dialog.close() }, t("message.cancel")))));
    document.body.append(dialog);
    dialog.showModal();
  });
}

/** Show a text until it is closed. */
export function tell(title, content) {
  const dialog = h("dialog", { class: "ask", aria: { label: title }, onclose: () => dialog.remove() }, h("h2", {}, title),
    h("form", { class: "stack", method: "dialog" }, content, h("div", { class: "buttons" }, h("button", { type: "submit", class: "primary" }, t("message.close")))));
  document.body.append(dialog);
  dialog.showModal();
}

/** Ask for confirmation of something that cannot be undone; `act`: the label of the button. */
export const askSure = (title, words, act) => ask(title, h("p", {}, words), act, true, () => true);

/** Ask for a name; return it, or null. */
export function askName(title, label, value, act) {
  const input = h("input", { type: "text", value, maxLength: 60, required: true, autocomplete: "off", spellcheck: false });
  return ask(title, h("label", { class: "field" }, h("span", {}, label), input), act, false, () => input.value.trim() || null);
}
