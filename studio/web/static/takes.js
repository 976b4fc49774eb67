// The list of takes: what is in it, search, selection; every change of a take, each of which can be taken back.
import { byId, h, redraw, setText } from "./dom.js";
import { calibrateTake, changeTake, restoreTake, solveTake, throwSolve, throwTake } from "./api.js";
import { askChoice } from "./ask.js";
import { askExport } from "./export.js";
import { ended } from "./jobs.js";
import { attempt, showNote, showUndo, undoing } from "./messages.js";
import { replayed } from "./replay.js";
import { t } from "./strings.js";
import { takeRow } from "./take_row.js";

const KEPT = "takes-search";
const BEST = ["finish", "studio", "live", "imported"];
const list = {
  takes: null, jobs: {}, failed: {}, pictures: 0, settings: () => ({}), search: sessionStorage.getItem(KEPT) ?? "", selected: new Set(), editing: "",
  changed: () => {},
};

/** The solve that shows a take best, by its name. */
export const bestSolve = (take) => BEST.find((name) => take.solves.includes(name)) ?? take.solves[0];

/** Do something to a take, then show the list anew. */
const alter = (action) => attempt(async () => { await action(); await list.changed(); });

const RESTORE = undoing("trash", (id) => alter(() => restoreTake(id)));
const CHANGE = undoing("slate", (take, before) => alter(() => changeTake(take, before)));

function throwAway(take) {
  return alter(async () => {
    const thrown = await throwTake(take);
    list.selected.delete(take.id);
    showUndo(t("take.in_trash", { name: take.name }), RESTORE, thrown.id);
  });
}

function removeSolve(take, solve) {
  return alter(async () => {
    const thrown = await throwSolve(take, solve);
    showUndo(t("solve.in_trash", { name: take.name, solve }), RESTORE, thrown.id);
  });
}

/** Change a take's slate; what it was before can be put back. */
function change(take, values) {
  const before = Object.fromEntries(Object.keys(values).map((key) => [key, take[key] ?? (key === "rating" ? 0 : "")]));
  if (Object.keys(values).every((key) => values[key] === before[key])) return show();
  return alter(async () => {
    const changed = await changeTake(take, values);
    showUndo(t("take.changed", { name: changed.name }), CHANGE, { session: changed.session, name: changed.name }, before);
  });
}

/** The preset's name where it is free or solved with the preset as it stands, else numbered. */
function solveName(take, settings) {
  if (Object.keys(settings.set).length === 0) return settings.preset;
  let number = 2;
  while (take.solves.includes(`${settings.preset}_${number}`)) number += 1;
  return `${settings.preset}_${number}`;
}

function solve(take) {
  return attempt(async () => {
    const chosen = list.settings();
    const { name } = await solveTake(take, solveName(take, chosen), chosen);
    showNote(t("take.solving_as", { name: take.name, solve: name }));
  });
}

/** Calibrate a take that has no calibration: from its own frames, or as another take of the same cameras. */
async function calibrate(take) {
  const alike = list.takes.filter((one) => one.calibrated && take.cameras.every((name) => one.cameras.includes(name)));
  const ways = [["", t("take.calibrate_own")], ...alike.map((one) => [one.id, t("take.calibrate_as", { name: one.id })])];
  const from = await askChoice(t("take.calibrate_label", { name: take.name }), t("take.calibrate_words"), t("take.calibrate_from"), ways, t("calibration.start"));
  if (from === null) return;
  await alter(async () => {
    const begun = await calibrateTake(take, from);
    if (from === "") await ended(begun);
    showNote(t("take.calibrated", { name: take.name }));
  });
}

function edit(take) {
  list.editing = list.editing === take?.id ? "" : take?.id ?? "";
  show();
  byId("slate-name")?.focus();
}

function select(take, chosen) {
  list.selected[chosen ? "add" : "delete"](take.id);
  showSelection();
}

const acts = { calibrate, change, edit, removeSolve, select, solve, throwAway };

function found() {
  const words = list.search.toLowerCase().split(/\s+/).filter(Boolean);
  return list.takes.filter((take) => {
    const text = `${take.id} ${take.notes} ${take.performer} ${take.starred ? "starred ★" : ""}`.toLowerCase();
    return words.every((word) => text.includes(word));
  });
}

function showSelection() {
  const chosen = list.takes.filter((take) => list.selected.has(take.id) && take.solves.length);
  redraw(byId("takes-selected"), chosen.map((take) => [take.id, take.solves]), () => (chosen.length < 2 ? [] : [
    h("button", { class: "small primary", type: "button", onclick: () => askExport(chosen.map((take) => ({ take, solve: bestSolve(take) }))) },
      t("export.many", { n: chosen.length })),
  ]));
}

function nothing() {
  if (list.takes.length) return h("p", { class: "empty" }, t("takes.none_found"));
  return h("p", { class: "empty" }, t("takes.none"));
}

function show() {
  if (!list.takes) return;
  const takes = found();
  const replay = replayed();
  const shown = replay.open ? `${replay.take}|${replay.solve}` : "";
  setText(byId("takes-count"), list.takes.length ? t("takes.count", { n: list.takes.length }) : "");
  byId("takes-search").hidden = list.takes.length < 2;
  redraw(byId("takes"), [takes, Object.keys(list.jobs), list.failed, list.editing, list.search, shown], () => (takes.length
    ? h("ul", {}, takes.map((take) => takeRow(take, {
      acts, best: bestSolve(take), editing: list.editing === take.id, job: list.jobs[take.id], failed: list.failed[take.id], picture: list.pictures, selected: list.selected.has(take.id), shown,
    })))
    : nothing()));
  for (const [id, job] of Object.entries(list.jobs)) {
    const bar = byId(`progress-${id}`);
    if (bar) bar.value = job.progress;
  }
  showSelection();
}

/** Show the takes, newest first; `running`: solves under way by take id, `failed`: those that ended without a result; `settings`:
 * returns preset and switches as set. */
export function updateTakes(takes, { running, failed }, settings) {
  Object.assign(list, { takes, jobs: running, failed, settings });
  show();
}

/** Take in how many pictures the server has made: where there are new ones, the list is loaded anew. */
export function updatePictures(made) {
  if (made === list.pictures) return;
  list.pictures = made;
  attempt(list.changed);
}

/** Begin; `changed` loads the takes anew. */
export function startTakes(changed) {
  list.changed = changed;
  byId("takes-search").value = list.search;
  byId("takes-search").addEventListener("input", (event) => {
    list.search = event.currentTarget.value;
    sessionStorage.setItem(KEPT, list.search);
    show();
  });
}
