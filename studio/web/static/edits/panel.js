// The panel with the edits of the replayed take: their list, undo and redo, and a form for edits over a range.
import { byId, clock, h, redraw } from "../base/dom.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";
import { rangeForm, showRange } from "./form.js";
import { change, isSolved, makeAgain, remove, solveAgain, solveWhole, split, startEditList, takeBack, useEdits } from "./list.js";
import { offerList, offersKey, startOffers } from "./offers.js";
import { startPicturePins } from "./picture_pin.js";
import { drawPins } from "./pins.js";
import { checkPin, leavePin, pinned, startPinning } from "./pinning.js";
import { editList } from "./state.js";
import { secondsOf, stageOf } from "./time.js";
import { foundBy, wordsOf } from "./words.js";

const state = { replay: { open: false }, goTo: () => {}, pin: () => {}, painted: () => {} };

const since = (time_s) => Number(secondsOf(time_s).toFixed(3));
const frameOf = (time_s) => Math.round(secondsOf(time_s) * state.replay.rate_hz);

function numberField(edit, label, value, onchange, step = 0.01) {
  return h("label", { class: "field" }, h("span", {}, label),
    h("input", { type: "number", value, step, aria: { label: `${label}, ${wordsOf(edit)}` }, onchange: (event) => {
      const typed = event.currentTarget.valueAsNumber;
      if (Number.isFinite(typed)) onchange(typed);
    } }));
}

/** Return the fields of an edit: its times, a pin's place and radius, its note. */
function details(edit) {
  const place = edit.kind === "pin" ? ["X", "Y", "Z"].map((axis, k) => numberField(edit, `${axis} [m]`, edit.place_m[k].toFixed(3),
    (typed) => change(edit, { place_m: edit.place_m.map((one, i) => (i === k ? typed : one)) }))) : [];
  return h("details", { id: `edit-more-${edit.id}` }, h("summary", { aria: { label: t("mend.more_of", { what: wordsOf(edit) }) } }, t("mend.more")),
    h("div", { class: "edit-fields" },
      numberField(edit, t("mend.from"), since(edit.start_s), (typed) => change(edit, { start_s: stageOf(typed), end_s: Math.max(edit.end_s, stageOf(typed)) })),
      numberField(edit, t("mend.to"), since(edit.end_s), (typed) => change(edit, { end_s: stageOf(typed), start_s: Math.min(edit.start_s, stageOf(typed)) })),
      edit.kind === "pin" && numberField(edit, t("mend.radius"), Number((100 * edit.radius_m).toFixed(1)), (typed) => change(edit, { radius_m: typed / 100 }), 0.5),
      ...place,
      h("label", { class: "field" }, h("span", {}, t("mend.note")), h("input", { type: "text", value: edit.note, maxLength: 500, onchange: (event) => change(edit, { note: event.currentTarget.value.trim() }) })),
      edit.start_s < edit.end_s && h("button", { id: `edit-split-${edit.id}`, type: "button", class: "small", title: t("mend.split_hint"), onclick: () => split(edit, stageOf(state.replay.frame / state.replay.rate_hz)) }, t("mend.split"))));
}

function row(edit) {
  const what = wordsOf(edit), from = clock(Math.max(since(edit.start_s), 0)), to = clock(Math.max(since(edit.end_s), 0));
  const at = edit.start_s === edit.end_s ? from : `${from} – ${to}`;
  const outcome = isSolved() && edit.on ? editList().solved?.edits?.[edit.id] : null;
  return h("li", { class: edit.on ? "" : "off" },
    h("div", { class: "edit-row" },
      h("input", { type: "checkbox", class: "operate", id: `edit-on-${edit.id}`, checked: edit.on, title: t("mend.on_hint"), aria: { label: t("mend.on", { what }) }, onchange: (event) => change(edit, { on: event.currentTarget.checked }) }),
      h("button", { id: `edit-go-${edit.id}`, type: "button", class: "small quiet edit-go", title: t("mend.go", { what }), onclick: () => state.goTo(frameOf(edit.start_s)) }, h("span", {}, what), h("span", { class: "count" }, at)),
      h("button", { type: "button", class: "small square quiet operate", aria: { label: t("mend.remove", { what }) }, onclick: () => remove(edit) }, "×")),
    edit.note && h("p", { class: "muted" }, edit.note),
    outcome?.line && h("p", { class: "fair" }, said(outcome.line)),
    ...(outcome?.mended ?? []).flatMap(foundBy).map((line) => h("p", { class: "muted found" }, line)),
    h("div", { class: "operate" }, details(edit)));
}

function build() {
  const list = editList(), joint = pinned();
  const button = (id, text, title, onclick, disabled = false) => h("button", { id, type: "button", class: "small operate", title, onclick, disabled }, text);
  return [
    h("div", { class: "buttons" },
      joint ? button("edit-leave", t("mend.leave"), "Esc", leavePin) : button("edit-pin", t("mend.pin"), `${t("mend.pin_hint")} (P)`, state.pin, state.replay.playing),
      button("edit-undo", t("mend.undo"), "Ctrl+Z", takeBack, !list.can_undo),
      button("edit-redo", t("mend.redo"), "Ctrl+Shift+Z", makeAgain, !list.can_redo)),
    h("p", { class: "muted", role: "status", id: "edit-said" }, joint ? t("mend.drag", { joint: t(`joint.${joint}`) }) : list.edits.length ? "" : t("mend.none")),
    list.says && h("p", { class: "muted" }, said(list.says)),
    list.solved?.edits_said && h("p", { class: "fair" }, said(list.solved.edits_said)),
    h("ul", { class: "edit-list", id: "edit-list" }, list.edits.map(row)),
    list.edits.length > 0 && h("div", { class: "buttons" },
      !isSolved() && button("edit-solve", t("mend.solve"), t("mend.solve_hint"), () => solveAgain()),
      button("edit-without", t("mend.without"), t("mend.without_hint"), () => solveWhole(true))),
    offerList(state.replay, state.goTo),
    rangeForm(state.replay, list),
  ].filter(Boolean);
}

/** Redraw the panel if it has changed. */
export function showEdits() {
  const { open, solve, take, playing, first, last, begins_s, rate_hz, performer, performers } = state.replay;
  byId("edits-panel").hidden = !open || !solve;
  drawPins();
  if (!open || !solve) return;
  const { revision, edits, can_undo, can_redo, says, cameras, solved } = editList();
  byId("edits-count").textContent = edits.length ? String(edits.length) : "";
  const opened = [...byId("edits").querySelectorAll("details[open]")].map((one) => one.id);
  redraw(byId("edits"), [take, solve, playing, first, last, begins_s, rate_hz, performer, performers, revision, edits, can_undo, can_redo, says, cameras, solved?.edits, solved?.edits_revision, pinned(), offersKey(state.replay)], build);
  for (const id of opened) if (byId(id)) byId(id).open = true;
  state.painted();
}

/** Handle the current replay and the stamp of its edits. */
export function updateEdits(replay, stamp) {
  checkPin(replay);
  state.replay = replay;
  useEdits(replay, stamp);
  showEdits();
  showRange(replay);
}

/** Start; `goTo` shows a frame, `pin` starts pinning the chosen joint, `painted` is called after each update. */
export function startEdits({ goTo, pin, painted }) {
  Object.assign(state, { goTo, pin, painted });
  startEditList(showEdits);
  startPinning(showEdits);
  startPicturePins();
  startOffers(showEdits);
  window.addEventListener("language", showEdits);
}
