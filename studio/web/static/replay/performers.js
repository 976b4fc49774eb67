// Performers of the replayed take, if there are several: whose curves are shown, their names, and where two were exchanged.
import { clock, h, redraw } from "../base/dom.js";
import { changeTake, getTakeDetail, solveTake } from "../base/api.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { t } from "../base/strings.js";

const MAX_NAME = 63;
const NUMBERED = /^performer_(\d+)$/;
const state = { of: "", take: "", names: {}, exchanges: [], solved: [], changed: () => {}, reopen: () => {} };

const named = (takeId) => ({ session: takeId.slice(0, takeId.indexOf("/")), name: takeId.slice(takeId.indexOf("/") + 1) });

/** Displayed name of a performer: as given, else by number. */
export function performerWords(name) {
  const number = NUMBERED.exec(name)?.[1];
  return number ? t("performers.number", { number }) : name;
}

/** Whether a replay shows several performers. */
export const several = ({ performers }) => (performers?.length ?? 0) > 1;

const nameOf = (replay, performer) => performerWords(replay.performers.find((one) => one.performer === performer)?.name ?? performer);

async function load(takeId, solve) {
  const found = await attempt(() => getTakeDetail(named(takeId)));
  if (!found || state.take !== takeId) return;
  Object.assign(state, { names: found.meta.performer_names ?? {}, exchanges: found.meta.exchanges ?? [], solved: found.solve_details[solve]?.metrics?.exchanges ?? [] });
  state.changed();
}

/** Set which take and solve are replayed, and request what is known about the performers. */
export function usePerformers(replay) {
  const of = several(replay) ? `${replay.take}|${replay.solve}` : "";
  if (state.of === of) return;
  Object.assign(state, { of, take: of && replay.take, names: {}, exchanges: [], solved: [] });
  if (of) load(replay.take, replay.solve);
}

/** Names of a take's performers; those of the replayed take are newer than the list of takes. */
export const namesOf = (take) => ({ ...take.performer_names, ...(state.take === take.id ? state.names : {}) });

/** Forget all: the solve was replaced by one of the same name. */
export function forgetPerformers() {
  state.of = "";
}

async function put(takeId, change) {
  await changeTake(named(takeId), change);
  if (state.take === takeId) {
    if (change.exchanges) state.exchanges = change.exchanges;
    if (change.performer_names) Object.assign(state, { of: "", names: change.performer_names });
  }
  if (change.performer_names) state.reopen(); // the view has the names
  state.changed();
}

const RESTORE = undoing("performers", (takeId, change) => attempt(() => put(takeId, change)));

const change = (takeId, values, before, words) => attempt(async () => {
  await put(takeId, values);
  showUndo(words, RESTORE, takeId, before);
});

/** Exchange two performers from a frame on: kept with the take, and applied when it is solved again. */
export function exchange(replay, frame, first, second) {
  const time_s = Number((replay.begins_s + (frame - 0.5) / replay.rate_hz).toFixed(4)); // this frame is the first
  const words = t("performers.exchanged", { first: nameOf(replay, first), second: nameOf(replay, second), at: clock(frame / replay.rate_hz) });
  change(replay.take, { exchanges: [...state.exchanges, { time_s, performers: [first, second] }] }, { exchanges: state.exchanges }, words);
}

function rename(replay, performer, name) {
  const before = state.names;
  if ((before[performer] ?? "") === name) return;
  change(replay.take, { performer_names: { ...before, [performer]: name } }, { performer_names: before }, t("performers.renamed", { name: name || nameOf(replay, performer) }));
}

const pending = () => JSON.stringify(state.exchanges) !== JSON.stringify(state.solved);

async function solveAgain(replay) {
  const begun = await attempt(() => solveTake(named(replay.take), replay.solve, { settings_of: replay.solve }));
  if (begun) showNote(t("take.solving_as", { name: named(replay.take).name, solve: replay.solve }));
}

function row(replay, { performer, name, colour }, frameNow) {
  const chosen = performer === replay.performer;
  const words = { first: nameOf(replay, replay.performer), second: nameOf(replay, performer) };
  return h("li", {},
    h("span", { class: "swatch", style: `background: ${colour}`, aria: { hidden: "true" } }),
    h("input", { class: "operate", id: `name-${performer}`, type: "text", maxLength: MAX_NAME, value: name === performer ? "" : name, placeholder: performerWords(performer), aria: { label: t("performers.name_of", { name: nameOf(replay, performer) }) },
      onchange: (event) => rename(replay, performer, event.currentTarget.value.trim()) }),
    !chosen && h("button", { class: "small operate", type: "button", title: t("performers.exchange_hint", words), aria: { label: t("performers.exchange_with", words) },
      onclick: () => exchange(replay, frameNow(), replay.performer, performer) }, t("performers.with", words)));
}

function exchangeRow(replay, one, i) {
  const words = { first: nameOf(replay, one.performers[0]), second: nameOf(replay, one.performers[1]), at: clock(Math.max(one.time_s - replay.begins_s, 0)) };
  const rest = state.exchanges.filter((_, k) => k !== i);
  return h("li", {}, h("span", {}, t("performers.exchange_row", words)),
    h("button", { class: "small square quiet operate", type: "button", aria: { label: t("performers.take_back", words) },
      onclick: () => change(replay.take, { exchanges: rest }, { exchanges: state.exchanges }, t("performers.taken_back", words)) }, "×"));
}

/** The list of performers, which the button over the timeline opens. */
export const performerList = h("ul", { id: "performer-list", class: "marker-list performer-list", hidden: true });

/** Return the replay bar's controls for performers: the choice of one, their list, the exchange of two. */
export function performerButtons(replay, frameNow, choice, choose) {
  if (!several(replay)) return [];
  const [first, second] = replay.performers.map((one) => one.performer);
  const two = replay.performers.length === 2, words = { first: nameOf(replay, first), second: nameOf(replay, second) };
  const list = () => { performerList.hidden = !performerList.hidden; state.changed(); };
  return [
    choice("replay-performer", t("performers.choice"), replay.performers.map((one) => [one.performer, performerWords(one.name)]), replay.performer, choose),
    h("button", { id: "replay-performers", type: "button", class: "small", title: t("performers.hint"), aria: { expanded: String(!performerList.hidden), controls: "performer-list" }, onclick: list }, t("performers.title")),
    h("button", { id: "replay-exchange", type: "button", class: "small operate", title: two ? t("performers.exchange_hint", words) : t("performers.exchange_choose"), aria: { label: t("performers.exchange") },
      onclick: () => (two ? exchange(replay, frameNow(), first, second) : list()) }, "⇄"),
  ];
}

/** Redraw the list of performers if it changed. */
export function showPerformers(replay, frameNow) {
  if (!several(replay)) performerList.hidden = true;
  redraw(performerList, [replay.take, replay.solve, replay.performer, replay.performers, state.exchanges, state.solved, replay.begins_s], () => (several(replay) ? [
    ...replay.performers.map((one) => row(replay, one, frameNow)),
    ...state.exchanges.map((one, i) => exchangeRow(replay, one, i)),
    pending() && h("li", { class: "pending" }, h("span", { class: "fair" }, t("performers.pending")),
      h("button", { id: "performers-solve", class: "small primary operate", type: "button", onclick: () => solveAgain(replay) }, t("performers.solve"))),
  ].filter(Boolean) : []));
}

/** Start; `changed` is called when names or exchanges change, `reopen` reopens the take. */
export function startPerformers(changed, reopen) {
  Object.assign(state, { changed, reopen });
}

/** Whether exchanges were made that the replayed solve does not have yet. */
export const exchangesPending = (replay) => several(replay) && pending();
