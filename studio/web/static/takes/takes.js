// The list of takes: rows of the found takes, more of them loaded on scrolling; every change of a take can be undone.
import { byId, h, redraw, setText, whenLetGo } from "../base/dom.js";
import { calibrateTake, changeTake, getCalibrations, restoreTake, solveTake, throwSolve, throwTake, throwVideo, useCalibration } from "../base/api.js";
import { ended } from "../base/jobs.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { replayed } from "../replay/replay.js";
import { language, t } from "../base/strings.js";
import { askCalibration, calibrationWords, showVerdicts } from "./calibrate.js";
import { foundTakes, loadMore, setSearch, takeOf } from "./found.js";
import { startSearch } from "./search.js";
import { isSelected, refreshSelection, select, selectAll, showSelection, startSelection } from "./selection.js";
import { bestSolve, freeName, openTake, takeRow } from "./take_row.js";

const AGAIN_MS = 1000; // while the server reads takes, the list is asked for again after so long

const list = { loaded: false, jobs: {}, failed: {}, pictures: 0, settings: () => ({}), editing: "", changed: () => {}, loading: false, again: 0 };
const rows = new Map(); // id -> {element, key}
const texts = new WeakMap(); // a take as text

/** Run an action on a take, then reload the list. */
const alter = (action) => attempt(async () => { await action(); await list.changed(); });

const RESTORE = undoing("trash", (id) => alter(() => restoreTake(id)));
const CALIBRATION = undoing("calibration", (take, number) => alter(() => useCalibration(take, number)));
const CHANGE = undoing("slate", (take, before) => alter(() => changeTake(take, before)));

function throwAway(take) {
  return alter(async () => {
    const thrown = await throwTake(take);
    select(take, false);
    showUndo(t("take.in_trash", { name: take.name }), RESTORE, thrown.id);
  });
}

function removeSolve(take, solve) {
  return alter(async () => {
    const thrown = await throwSolve(take, solve);
    showUndo(t("solve.in_trash", { name: take.name, solve }), RESTORE, thrown.id);
  });
}

function removeVideo(take) {
  return alter(async () => {
    const thrown = await throwVideo(take);
    showUndo(t("video.in_trash", { name: take.name }), RESTORE, thrown.id);
  });
}

/** Change a take's slate; the previous one can be restored. */
function change(take, values) {
  const before = Object.fromEntries(Object.keys(values).map((key) => [key, take[key] ?? (key === "rating" ? 0 : "")]));
  if (Object.keys(values).every((key) => JSON.stringify(values[key]) === JSON.stringify(before[key]))) return show();
  return alter(async () => {
    const changed = await changeTake(take, values);
    showUndo(t("take.changed", { name: changed.name }), CHANGE, { session: changed.session, name: changed.name }, before);
  });
}

function solve(take) {
  return attempt(async () => {
    const chosen = list.settings();
    const { name } = await solveTake(take, freeName(take, chosen), chosen);
    showNote(t("take.solving_as", { name: take.name, solve: name }));
  });
}

/** Calibrate a take, and show the result; the previous calibration can be restored. */
async function calibrate(take) {
  const asked = await attempt(() => askCalibration(take));
  if (!asked) return;
  const { known, before } = asked;
  await alter(async () => {
    const begun = await calibrateTake(take, known);
    if (!known.borrow) await ended(begun);
    const found = await getCalibrations(take), words = calibrationWords(take, found);
    showVerdicts(take, found);
    if (before === null) showNote(words);
    else showUndo(words, CALIBRATION, { session: take.session, name: take.name }, before);
  });
}

function edit(take) {
  list.editing = list.editing === take?.id ? "" : take?.id ?? "";
  show();
  byId("slate-name")?.focus();
}

function search(text) {
  if (byId("takes-search").value !== text) byId("takes-search").value = text;
  setSearch(text);
  attempt(list.changed);
}

const acts = { calibrate, change, edit, removeSolve, search, select, solve, throwAway, throwVideo: removeVideo };

async function more() {
  if (list.loading) return;
  list.loading = true;
  await attempt(loadMore);
  list.loading = false;
  show();
  moreSeen.unobserve(byId("takes-more")); // which may be in sight still
  moreSeen.observe(byId("takes-more"));
}

const moreSeen = new IntersectionObserver((entries) => { if (entries.some((entry) => entry.isIntersecting)) more(); }, { rootMargin: "600px" });

/** Return the row of a take, rebuilt only if its content changed. */
function rowOf(take, shown) {
  if (!texts.has(take)) texts.set(take, JSON.stringify(take));
  const own = shown.startsWith(`${take.id}|`) ? shown : "";
  const [job, failed] = [list.jobs[take.id], list.failed[take.id]];
  const editing = list.editing === take.id;
  const key = JSON.stringify([texts.get(take), own, job?.id, job?.so_far_s, failed?.id, editing, isSelected(take), list.pictures, language()]);
  const before = rows.get(take.id);
  const typing = editing && before?.element.querySelector(".slate"); // what was typed stays
  if (before?.key === key || typing) return before.element;
  const element = takeRow(take, { acts, best: bestSolve(take), editing, failed, job, picture: list.pictures, selected: isSelected(take), shown });
  rows.set(take.id, { element, key });
  return element;
}

function showRows(takes) {
  const replay = replayed();
  const shown = replay.open ? `${replay.take}|${replay.solve}` : "";
  const place = byId("takes-list"), focused = place.contains(document.activeElement) ? document.activeElement.id : "";
  const wanted = takes.map((take) => rowOf(take, shown));
  wanted.forEach((element, i) => {
    if (place.children[i] !== element) place.insertBefore(element, place.children[i] ?? null);
  });
  while (place.children.length > wanted.length) place.lastElementChild.remove();
  const known = new Set(takes.map((take) => take.id));
  for (const id of rows.keys()) if (!known.has(id)) rows.delete(id);
  if (focused && document.activeElement?.id !== focused) byId(focused)?.focus();
}

/** Show the actions on the replayed take, above the list. */
function showOpenTake() {
  const { open, take: id, solve: name } = replayed();
  const take = open ? takeOf(id) : null;
  const job = take && list.jobs[id];
  redraw(byId("open-take"), take && [take, name, job?.id], () => (take ? openTake(take, name, { acts, job }) : []));
  if (job && byId("open-progress")) byId("open-progress").value = job.progress;
}

function show() {
  if (!list.loaded) return;
  showOpenTake();
  const { takes, count, total, reading, search: words, problem } = foundTakes();
  setText(byId("takes-count"), words && !problem ? t("takes.found", { n: count, total: reading?.done ?? total }) : total ? t("takes.count", { n: total }) : "");
  byId("takes-reading").hidden = !reading;
  setText(byId("takes-reading"), reading ? t("takes.reading", { done: reading.done.toLocaleString(language()), of: reading.of.toLocaleString(language()) }) : "");
  byId("takes-find").hidden = total < 2 && !words;
  byId("takes-problem").hidden = !problem;
  setText(byId("takes-problem"), problem);
  whenLetGo(byId("takes-list"), () => showRows(takes));
  byId("takes-empty").hidden = takes.length > 0;
  setText(byId("takes-empty"), t(reading ? "takes.none_yet" : words ? "takes.none_found" : "takes.none"));
  byId("takes-more").hidden = takes.length >= count;
  setText(byId("takes-more"), t("takes.more", { shown: takes.length, n: count }));
  for (const [id, job] of Object.entries(list.jobs)) {
    const bar = byId(`progress-${id}`);
    if (bar) bar.value = job.progress;
  }
  showSelection();
}

/** Ask for the list again soon, as long as the server still reads takes. */
function askAgain() {
  if (list.again || !foundTakes().reading) return;
  list.again = setTimeout(async () => {
    await attempt(list.changed);
    list.again = 0;
    askAgain();
  }, AGAIN_MS);
}

/** Show the takes that were found; `running`: solves under way by take id, `failed`: those that ended without a result;
 * `settings`: returns preset and switches as set. */
export function updateTakes({ running, failed }, settings) {
  Object.assign(list, { loaded: true, jobs: running, failed, settings });
  refreshSelection(takeOf);
  askAgain();
  show();
}

/** Set how many pictures the server has made; if there are new ones, reload the list. */
export function updatePictures(made) {
  if (made === list.pictures) return;
  list.pictures = made;
  attempt(list.changed);
}

/** Start; `changed` reloads the takes. */
export function startTakes(changed) {
  list.changed = changed;
  byId("takes").replaceChildren(
    h("ul", { id: "takes-list" }),
    h("p", { id: "takes-empty", class: "empty" }, t("app.loading")),
    h("button", { id: "takes-more", class: "small", type: "button", hidden: true, onclick: more }, t("takes.more", { shown: 0, n: 0 })));
  moreSeen.observe(byId("takes-more"));
  startSelection({ changed, settings: () => list.settings(), show });
  startSearch({ search, all: () => selectAll(foundTakes().takes) });
}
