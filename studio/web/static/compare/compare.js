// The compare view: a second motion next to the replayed one, the distance between them, and the figures of both.
import { byId, clock, h, redraw, setText } from "../base/dom.js";
import { compareMotions, getFigures } from "../base/api.js";
import { drawDifference, nearest } from "./compare_curve.js";
import { figureTable, jointTable } from "./compare_tables.js";
import { attempt } from "../base/messages.js";
import { whileMoving } from "../base/moving.js";
import { PeopleFigures } from "./compare_people.js";
import { ReferenceSection } from "./reference.js";
import { performerWords, several } from "../replay/performers.js";
import { change, frameNow, goTo, open, replayed } from "../replay/replay.js";
import { number, t } from "../base/strings.js";
import { frameAt } from "../replay/timeline.js";

const APART_M = 1.4;
const STEP_MS = 10;
const SETTLE_MS = 350; // a figure that is being moved is compared once it rests
const KEPT = "compare";

const state = {
  shown: false, takes: [], found: null, foundKey: "", wantedKey: "", failure: "", joint: "", timer: 0, against: "",
  figures: new Map(), measured: 0, references: null, people: null, put_away: null,
};

const sideKey = (side) => (side.reference ? `${side.take}|ref:${side.reference}` : `${side.take}|${side.solve}`);
const takeOf = (id) => state.takes.find((one) => one.id === id);
const shortName = (side, takeId) => side.reference ?? (side.take === takeId ? side.solve : `${side.take.split("/").pop()}: ${side.solve}`);

/** Return the replayed motion; with several performers, that of the performer in the curves. */
const sideOf = ({ take, solve, performer }) => ({ take, solve, ...(performer && { performer }) });

/** Return the current comparison as a key. */
function keyNow() {
  const { take, solve, performer, ghost, ghost_offset_ms: offset } = replayed();
  return JSON.stringify([take, solve, performer, ghost, offset]);
}

function show(shown) {
  state.shown = shown;
  sessionStorage.setItem(KEPT, shown ? "open" : "");
  document.body.classList.toggle("comparing", shown);
  updateCompare();
}

/** Open or close the compare view. The second figure closes with it, and returns with it while the take is open. */
export function toggleCompare() {
  show(!state.shown);
  const { open: isOpen, take: takeId, solve, ghost } = replayed();
  if (!isOpen) return;
  if (!state.shown) {
    state.put_away = ghost && { take: takeId, ghost };
    if (ghost) open(takeId, solve);
    return;
  }
  if (ghost) return;
  const other = takeOf(takeId)?.solves.find((name) => name !== solve);
  if (state.put_away?.take === takeId) open(takeId, solve, state.put_away.ghost);
  else if (other) open(takeId, solve, { take: takeId, solve: other });
}

/** Open the compare view on the current replay. */
export const openCompare = () => show(true);

// --- what is compared

function otherSides() {
  const { take: takeId, solve } = replayed();
  const own = (takeOf(takeId)?.solves ?? []).filter((name) => name !== solve).map((name) => ({ take: takeId, solve: name }));
  const references = state.references.names.map((reference) => ({ take: takeId, reference }));
  const others = state.takes.filter((one) => one.id !== takeId).flatMap((one) => one.solves.map((name) => ({ take: one.id, solve: name })));
  return [["compare.solves", own], ["compare.references", references], ["compare.other_takes", others]];
}

/** Show another solve of the take; a second motion that was lined up is lined up again. */
async function chooseFirst(solve) {
  const { take: takeId, ghost } = replayed();
  await open(takeId, solve, ghost);
  if (ghost?.lined_up) await lineUp(true);
}

async function chooseOther(value) {
  const { take: takeId, solve } = replayed();
  const side = otherSides().flatMap(([, sides]) => sides).find((one) => sideKey(one) === value);
  await open(takeId, solve, side ?? null);
}

/** Move another take to the place and time of the replayed one, or back. */
async function lineUp(wanted) {
  const { take: takeId, solve, ghost } = replayed();
  const plain = { take: ghost.take, solve: ghost.solve };
  if (!wanted) return open(takeId, solve, plain);
  const found = await attempt(() => compareMotions({ a: sideOf(replayed()), b: plain, line_up: true }));
  if (!found) return undefined;
  return open(takeId, solve, { ...plain, alignment: found.alignment });
}

function choices() {
  const { take: takeId, solve, ghost, ghost_apart_m: apart, ghost_offset_ms: offset } = replayed();
  const own = takeOf(takeId)?.solves ?? [solve];
  const option = (value, text, chosen) => h("option", { value, selected: chosen }, text);
  const swatch = (side) => h("span", { class: `swatch side-${side}`, aria: { hidden: "true" } });
  const move = (by) => change({ ghost_offset_ms: Math.round(offset + by) });
  const segment = (id, label, pressed, value) => h("button", { id, type: "button", aria: { pressed: String(pressed) }, onclick: () => change({ ghost_apart_m: value }) }, label);
  return [
    h("label", { class: "side-choice" }, swatch(0), h("select", { id: "compare-a", aria: { label: t("compare.first") }, onchange: (event) => chooseFirst(event.currentTarget.value) },
      own.map((name) => option(name, name, name === solve)))),
    h("label", { class: "side-choice" }, swatch(1), h("select", { id: "compare-b", aria: { label: t("compare.second") }, onchange: (event) => chooseOther(event.currentTarget.value) },
      option("", t("compare.nothing"), !ghost),
      otherSides().filter(([, sides]) => sides.length).map(([key, sides]) => h("optgroup", { label: t(key) },
        sides.map((side) => option(sideKey(side), shortName(side, takeId), ghost && sideKey(ghost) === sideKey(side))))))),
    ghost && h("div", { class: "placing" },
      h("div", { class: "segments", role: "group", aria: { label: t("compare.arrangement") } },
        segment("compare-overlaid", t("compare.overlaid"), apart === 0, 0), segment("compare-beside", t("compare.beside"), apart !== 0, APART_M)),
      h("div", { class: "nudge", role: "group", aria: { label: t("compare.offset") }, title: t("compare.offset_hint") },
        h("button", { class: "small square", type: "button", onclick: () => move(-STEP_MS), aria: { label: t("compare.earlier") } }, "−"),
        h("input", { id: "compare-offset", type: "number", step: STEP_MS, value: Math.round(offset), aria: { label: t("compare.offset") },
          onchange: (event) => change({ ghost_offset_ms: Number(event.currentTarget.value) || 0 }) }),
        h("span", { class: "muted" }, "ms"),
        h("button", { class: "small square", type: "button", onclick: () => move(STEP_MS), aria: { label: t("compare.later") } }, "+"))),
    ghost && !ghost.reference && ghost.take !== takeId && h("label", { class: "check", title: t("compare.line_up_hint") },
      h("input", { id: "compare-line-up", type: "checkbox", checked: Boolean(ghost.lined_up), onchange: (event) => lineUp(event.currentTarget.checked) }), t("compare.line_up")),
  ].filter(Boolean);
}

// --- how far they are apart

function ask() {
  const { ghost, ghost_offset_ms: offset } = replayed();
  const key = keyNow();
  if (!ghost || key === state.wantedKey) return;
  state.wantedKey = key;
  clearTimeout(state.timer);
  state.timer = setTimeout(async () => {
    if (key !== keyNow()) { // the replay was closed meanwhile
      state.wantedKey = "";
      return;
    }
    const { lined_up: line_up = false, ...b } = ghost;
    try {
      const found = await compareMotions({ a: sideOf(replayed()), b, line_up, offset_ms: offset });
      if (key !== state.wantedKey) return;
      Object.assign(state, { found, foundKey: key, failure: "" });
    } catch (error) {
      if (key === state.wantedKey) Object.assign(state, { found: null, foundKey: key, failure: error.message });
    }
    updateCompare();
  }, state.foundKey ? SETTLE_MS : 0);
}

function scrub(event) {
  const canvas = event.currentTarget;
  canvas.setPointerCapture(event.pointerId);
  const move = (moved) => goTo(frameAt(canvas, moved, replayed()));
  move(event);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", () => canvas.removeEventListener("pointermove", move), { once: true });
}

function chooseJoint(joint) {
  state.joint = state.joint === joint ? "" : joint;
  updateCompare();
}

function difference() {
  const { ghost } = replayed();
  if (!ghost) return [h("p", { class: "empty" }, t("compare.choose"))];
  if (state.foundKey !== keyNow()) return [h("p", { class: "muted" }, t("compare.computing")), h("progress", { aria: { label: t("compare.computing") } })];
  if (!state.found) return [h("p", { class: "bad" }, state.failure)];
  const { found } = state;
  return [
    h("canvas", { id: "compare-curve", class: "curve", onpointerdown: scrub, aria: { label: t("compare.curve") }, role: "img" }),
    h("p", { class: "summary" }, h("strong", { id: "compare-now" }), h("span", { class: "muted" },
      t("compare.summary", { mean: number(found.mean_mm), p95: number(found.p95_mm), max: number(found.max_mm) }))),
    h("div", { class: "moments" }, found.worst.slice(0, 5).map((one) => h("button", {
      class: "small", type: "button", title: t("compare.go_there"), onclick: () => { state.joint = one.joint; goTo(frameOf(one.time_s)); updateCompare(); },
    }, `${clock(secondsOf(one.time_s))}  ${t(`joint.${one.joint}`)}  ${number(one.mm)}`))),
  ];
}

const secondsOf = (stage_s) => stage_s - replayed().begins_s;
const frameOf = (stage_s) => Math.round(secondsOf(stage_s) * replayed().rate_hz);

/** Show the distances at the current frame. */
function paint() {
  const { found } = state;
  const canvas = byId("compare-curve");
  if (!canvas || !found || !state.shown) return;
  const frame = frameNow();
  drawDifference(canvas, found, state.joint, replayed(), frame);
  const at = nearest(found.frame, frame);
  const words = (value) => (value === null || value === undefined ? "–" : number(value));
  setText(byId("compare-now"), t("compare.now_mm", { mm: words(found.mean_over_joints_mm[at]) }));
  for (const [joint, values] of Object.entries(found.joints_mm)) {
    const cell = byId(`apart-${joint}`);
    if (cell) setText(cell, words(values[at]));
  }
}

// --- figures

const figuresKey = (side) => `${side.take}|${side.solve}|${side.take === replayed().take ? state.against : ""}|${side.performer ?? ""}`;

/** Return the second figure, with the replayed performer if its take has that one. */
const beside = (ghost) => (takeOf(ghost.take)?.performers.includes(replayed().performer) ? { ...ghost, performer: replayed().performer } : ghost);

async function loadFigures(side) {
  const key = figuresKey(side);
  if (!side.solve || state.figures.has(key)) return;
  state.figures.set(key, null);
  try {
    state.figures.set(key, await getFigures(side, key.split("|")[2]));
  } catch (error) {
    state.figures.set(key, { failure: error.message });
  }
  state.measured += 1;
  updateCompare();
}

/** Return the shown solves of the replayed take. */
function solvesShown() {
  const { take: takeId, solve, ghost } = replayed();
  return ghost?.solve && ghost.take === takeId ? [solve, ghost.solve] : [solve];
}

/** Return the part between the in and out points as a query of the blind test page; end 0: to the end. */
const partOf = ({ first, last, frames, rate_hz: rate }) =>
  new URLSearchParams({ start: (first / rate).toFixed(2), end: last < frames - 1 ? (last / rate).toFixed(2) : "0" });

function figures() {
  const { take: takeId, solve, ghost } = replayed();
  const sides = [sideOf(replayed()), ...(ghost ? [beside(ghost)] : [])];
  const values = sides.map((side) => (side.solve ? state.figures.get(figuresKey(side)) : { own: null, reference: null }));
  const names = sides.map((side) => (side.reference ? t("compare.reference") : shortName(side, takeId)));
  const busy = values.some((one) => !one);
  const failures = [...new Set(values.map((one) => one?.failure).filter(Boolean))];
  const references = state.references.names;
  const whose = several(replayed()) && replayed().performers.find((one) => one.performer === replayed().performer);
  return [
    whose && h("p", { class: "whose" }, h("span", { class: "swatch", style: `background: ${whose.colour}`, aria: { hidden: "true" } }), performerWords(whose.name)),
    h("label", { class: "field against" }, h("span", {}, t("compare.against")), h("select", { id: "compare-against", disabled: !references.length, onchange: (event) => { state.against = event.currentTarget.value; updateCompare(); } },
      h("option", { value: "" }, references.length ? t("compare.no_reference") : t("compare.none_loaded")), references.map((name) => h("option", { value: name, selected: name === state.against }, name)))),
    busy ? h("progress", { aria: { label: t("compare.measuring") } }) : figureTable(names, values, state.against),
    ...state.people.build(replayed(), solvesShown(), references),
    ...failures.map((words) => h("p", { class: "bad" }, words)),
    h("p", { class: "muted hint" }, t(state.against ? "compare.marked" : "compare.marked_alone")),
    ghost?.solve && h("a", {
      class: "button small", href: `blind?a=${encodeURIComponent(`${takeId}|${solve}`)}&b=${encodeURIComponent(`${ghost.take}|${ghost.solve}`)}&${partOf(replayed())}`, title: t("replay.blind_hint"),
    }, t("compare.blind")),
  ].filter(Boolean);
}

/** Redraw whatever has changed in the view. */
export function updateCompare() {
  const replay = replayed();
  const visible = state.shown && replay.open && Boolean(replay.solve); // without a solve there is nothing to compare
  document.body.classList.toggle("comparing", state.shown && replay.solve !== "");
  byId("compare").hidden = !visible;
  byId("replay-compare")?.setAttribute("aria-pressed", String(state.shown));
  if (!visible) return;
  const { take: takeId, solve, ghost, ghost_apart_m: apart, ghost_offset_ms: offset } = replay;
  state.references.use(takeId, solve);
  const { names } = state.references;
  if (state.against && !names.includes(state.against)) state.against = "";
  if (ghost?.reference && !state.against && names.includes(ghost.reference)) state.against = ghost.reference;
  redraw(byId("compare-choice"), [takeId, solve, ghost, apart, offset, names, state.takes.map((one) => [one.id, one.solves])], choices);
  ask();
  redraw(byId("compare-difference"), [ghost, state.foundKey === keyNow() && state.foundKey, state.joint, state.failure], difference);
  const found = state.foundKey === keyNow() ? state.found : null;
  byId("compare-joints-panel").hidden = !ghost || !found;
  if (found) redraw(byId("compare-joints"), [state.foundKey, state.joint], () => jointTable(found, state.joint, chooseJoint));
  loadFigures(sideOf(replay));
  if (ghost?.solve) loadFigures(beside(ghost));
  redraw(byId("compare-figures"), [takeId, solve, replay.performer, replay.performers, ghost, state.against, names, state.measured, state.people.version, replay.first, replay.last], figures);
  state.references.draw();
  paint();
  paintOn();
}

/** Set the list of takes. */
export function updateCompareTakes(takes) {
  state.takes = takes;
  updateCompare();
}

function forget() {
  state.figures.clear();
  state.people.forget();
  state.measured += 1;
  Object.assign(state, { foundKey: "", wantedKey: "" });
}

/** Forget all measurements, because a solve was made again. */
export function forgetMeasured() {
  forget();
  updateCompare();
}

const paintOn = whileMoving(() => state.shown && replayed().playing, paint);

/** Start. */
export function startCompare() {
  state.references = new ReferenceSection({
    changed: updateCompare,
    measured: forget,
    show: (reference) => { const { take: takeId, solve } = replayed(); return open(takeId, solve, reference ? { take: takeId, reference } : null); },
  });
  state.people = new PeopleFigures(updateCompare);
  byId("compare-close").addEventListener("click", toggleCompare);
  state.shown = sessionStorage.getItem(KEPT) === "open";
  document.body.classList.toggle("comparing", state.shown);
  new ResizeObserver(paint).observe(byId("compare"));
}
