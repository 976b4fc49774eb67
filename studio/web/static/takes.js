// The list of takes: search, slate (name, star, rating, notes), solve again, replay, export, trash with undo.
import { byId, clock, h, redraw, setText } from "./dom.js";
import { changeTake, restoreTake, solveTake, throwTake } from "./api.js";
import { askExport } from "./export.js";
import { attempt, showNote } from "./messages.js";
import { open } from "./replay.js";
import { askShare } from "./sharing.js";
import { language, t } from "./strings.js";

const STARS = 5;
const list = { takes: [], jobs: {}, settings: () => ({}), search: "", selected: new Set(), editing: "", changed: () => {} };

function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const today = new Date().toDateString() === date.toDateString();
  const time = date.toLocaleTimeString(language, { hour: "2-digit", minute: "2-digit" });
  return today ? time : `${date.toLocaleDateString(language, { day: "numeric", month: "short" })} ${time}`;
}

/** Do something to a take, then show the list anew. */
const alter = (action) => attempt(async () => { await action(); await list.changed(); });

async function throwAway(take) {
  await alter(async () => {
    const thrown = await throwTake(take);
    list.selected.delete(take.id);
    const undo = () => alter(() => restoreTake(thrown.id));
    list.undo = undo;
    showNote(t("take.in_trash", { name: take.name }), { label: t("message.undo"), run: undo });
  });
}

/** Take back the last take that was thrown away; return whether there was one. */
export function undoThrow() {
  const { undo } = list;
  list.undo = null;
  undo?.();
  return Boolean(undo);
}

function small(text, label, onclick, title = label) {
  return h("button", { class: "small", type: "button", onclick, title, aria: { label } }, text);
}

function solveRow(take, solve) {
  return h("li", { class: "solve-row" },
    small("▶", t("take.replay", { name: take.name, solve }), () => open(take.id, solve), t("take.replay_hint")),
    h("span", { class: "name", title: t("take.solve_hint", { solve }) }, solve),
    small(t("export.short"), t("take.export", { name: take.name, solve }), () => askExport([{ take, solve }])),
    small(t("share.short"), t("share.take", { name: take.name, solve }), () => askShare(take, solve), t("share.hint")));
}

/** The preset's name where it is free or solved with the preset as it stands, else numbered. */
function solveName(take, settings) {
  const changed = Object.keys(settings.set).length > 0;
  if (!changed) return settings.preset;
  let number = 2;
  while (take.solves.includes(`${settings.preset}_${number}`)) number += 1;
  return `${settings.preset}_${number}`;
}

function solveButton(take, solving) {
  return h("button", {
    class: "small", type: "button", disabled: solving || take.recording,
    title: t("take.solve_with"), aria: { label: t("take.solve_label", { name: take.name }) },
    onclick: () => attempt(async () => {
      const chosen = list.settings();
      const { name } = await solveTake(take, solveName(take, chosen), chosen);
      showNote(t("take.solving_as", { name: take.name, solve: name }));
    }),
  }, t(solving ? "take.solving" : "take.solve"));
}

function slate(take) {
  const save = (event) => {
    event.preventDefault();
    const value = (name) => byId(`slate-${name}`).value.trim();
    list.editing = "";
    alter(() => changeTake(take, { name: value("name"), notes: value("notes"), rating: Number(value("rating")) }));
  };
  const field = (name, label, text) => h("label", { class: "field" }, h("span", {}, label), h("input", { id: `slate-${name}`, type: "text", maxLength: name === "name" ? 60 : 2000, value: text ?? "" }));
  return h("form", { class: "slate", onsubmit: save },
    field("name", t("take.name"), take.name), field("notes", t("take.notes"), take.notes),
    h("label", { class: "field" }, h("span", {}, t("take.rating")), h("select", { id: "slate-rating" },
      [...Array(STARS + 1).keys()].map((stars) => h("option", { value: stars, selected: stars === (take.rating ?? 0) }, stars ? "★".repeat(stars) : t("take.no_rating"))))),
    h("div", { class: "buttons" },
      h("button", { class: "small primary", type: "submit" }, t("message.save")),
      small(t("message.cancel"), t("message.cancel"), () => { list.editing = ""; show(); }),
      small(t("take.throw"), t("take.throw_label", { name: take.name }), () => { list.editing = ""; throwAway(take); }, t("take.throw_hint"))));
}

function head(take, solving) {
  const line = [take.seconds === null ? "" : clock(take.seconds), when(take.created), take.rating ? "★".repeat(take.rating) : ""];
  return h("div", { class: "take-head", title: take.problem || take.notes || take.id },
    h("input", {
      type: "checkbox", checked: list.selected.has(take.id), aria: { label: t("take.select", { name: take.name }) },
      onchange: (event) => { list.selected[event.currentTarget.checked ? "add" : "delete"](take.id); showSelection(); },
    }),
    h("button", {
      class: `star ${take.starred ? "on" : ""}`, type: "button", aria: { label: t("take.star", { name: take.name }), pressed: String(Boolean(take.starred)) },
      onclick: () => alter(() => changeTake(take, { starred: !take.starred })),
    }, take.starred ? "★" : "☆"),
    h("span", { class: "name" }, take.name),
    h("span", { class: "when" }, line.filter(Boolean).join("  ·  ")),
    !take.recording && small(t("take.edit"), t("take.edit_label", { name: take.name }), () => { list.editing = list.editing === take.id ? "" : take.id; show(); }, t("take.edit_hint")),
    solveButton(take, solving));
}

function row(take) {
  const job = list.jobs[take.id];
  return h("li", { class: "take" },
    head(take, job !== undefined),
    job && h("progress", { max: 1, value: job.progress, id: `progress-${take.id}`, aria: { label: t("take.solve_label", { name: take.name }) } }),
    take.notes && h("p", { class: "muted notes" }, take.notes),
    take.problem && h("p", { class: "fair" }, take.problem),
    list.editing === take.id && slate(take),
    take.solves.length > 0 && h("ul", {}, take.solves.map((solve) => solveRow(take, solve))));
}

function found() {
  const words = list.search.toLowerCase().split(/\s+/).filter(Boolean);
  return list.takes.filter((take) => {
    const text = `${take.id} ${take.notes} ${take.performer} ${take.starred ? "starred ★" : ""}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

/** The solve of a take that an export of several takes: the best by its name. */
const bestSolve = (take) => ["finish", "studio", "live", "imported"].find((name) => take.solves.includes(name)) ?? take.solves[0];

function showSelection() {
  const chosen = list.takes.filter((take) => list.selected.has(take.id) && take.solves.length);
  byId("takes-selected").replaceChildren(...(chosen.length < 2 ? [] : [
    small(t("export.many", { n: chosen.length }), t("export.many", { n: chosen.length }), () => askExport(chosen.map((take) => ({ take, solve: bestSolve(take) })))),
  ]));
}

function show() {
  const takes = found();
  setText(byId("takes-count"), list.takes.length ? t("takes.count", { n: list.takes.length }) : "");
  byId("takes-search").hidden = list.takes.length < 2;
  redraw(byId("takes"), [takes, Object.keys(list.jobs), list.editing, list.search], () => {
    if (takes.length) return h("ul", {}, takes.map(row));
    return h("p", { class: "empty" }, t(list.takes.length ? "takes.none_found" : "takes.none"));
  });
  for (const [id, job] of Object.entries(list.jobs)) {
    const bar = byId(`progress-${id}`);
    if (bar) bar.value = job.progress;
  }
  showSelection();
}

/** Show the takes, newest first; `jobs`: solves under way by take id; `settings`: returns preset and switches as set. */
export function updateTakes(takes, jobs, settings) {
  Object.assign(list, { takes, jobs, settings });
  show();
}

/** Begin; `changed` loads the takes anew. */
export function startTakes(changed) {
  list.changed = changed;
  byId("takes-search").addEventListener("input", (event) => { list.search = event.currentTarget.value; show(); });
}
