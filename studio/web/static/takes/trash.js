// The trash: what was thrown away, put back or deleted for good.
import { byId, h } from "../base/dom.js";
import { deleteTrash, emptyTrash, getTrash, restoreTake } from "../base/api.js";
import { askSure } from "../base/ask.js";
import { attempt } from "../base/messages.js";
import { language, t } from "../base/strings.js";

const dialog = { changed: () => {} };

const nameOf = (thrown) => (thrown.video ? t("trash.video", { name: thrown.name }) : thrown.solve ? t("trash.solve", { name: thrown.name, solve: thrown.solve }) : thrown.name);
const dayOf = (thrown) => new Date(thrown.thrown).toLocaleString(language(), { day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" });

/** Run an action on the trash, then show it again. */
const alter = (action) => attempt(async () => { await action(); await show(); await dialog.changed(); });

async function deleteOne(thrown) {
  const name = nameOf(thrown);
  if (await askSure(t("trash.delete_title"), t("trash.delete_sure", { name }), t("trash.delete"))) alter(() => deleteTrash(thrown.id));
}

async function empty(count) {
  if (await askSure(t("trash.empty_title"), t("trash.empty_sure", { n: count }), t("trash.empty"))) alter(emptyTrash);
}

function row(thrown) {
  const name = nameOf(thrown);
  return h("li", { class: "solve-row" },
    h("span", { class: "name", title: `${thrown.session}/${thrown.name}` }, name),
    h("span", { class: "muted" }, dayOf(thrown)),
    h("button", { class: "small", type: "button", onclick: () => alter(() => restoreTake(thrown.id)), aria: { label: t("trash.restore_label", { name }) } }, t("trash.restore")),
    h("button", { class: "small quiet", type: "button", onclick: () => deleteOne(thrown), aria: { label: t("trash.delete_label", { name }) } }, t("trash.delete")));
}

async function show() {
  const thrown = await getTrash();
  byId("trash").replaceChildren(
    h("h2", {}, t("trash.title")),
    thrown.length ? h("ul", {}, thrown.map(row)) : h("p", { class: "empty" }, t("trash.none")),
    h("div", { class: "buttons" },
      h("button", { class: "primary", type: "button", onclick: () => byId("trash").close() }, t("message.close")),
      thrown.length > 0 && h("button", { type: "button", onclick: () => empty(thrown.length) }, t("trash.empty"))));
}

/** Connect the button; `changed` reloads the takes. */
export function startTrash(changed) {
  dialog.changed = changed;
  byId("trash-open").addEventListener("click", () => attempt(async () => { await show(); byId("trash").showModal(); }));
}
