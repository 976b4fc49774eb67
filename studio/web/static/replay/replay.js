// Replay of a take: the bar under the view, its keys, and where the playhead is between two messages of the server.
import { byId, clock, h, redraw, setText } from "../base/dom.js";
import { changeReplay, closeReplay, getCleanup, getCurves, getView, openReplay } from "../base/api.js";
import { besideIs, changeCurvesOf, curveLegend, curveList, curveListShown, showCurveList, showLegend, startCurveChoice } from "./curve_choice.js";
import { forgetCurveData, loadCurveData, startCurveData } from "./curve_data.js";
import { JOINTS, editSpans } from "./curves.js";
import { startBodies } from "./bodies.js";
import { grab, removeChosen } from "../edits/bars.js";
import { forgetSolved } from "../edits/list.js";
import { offersAgain } from "../edits/offers.js";
import { startEdits } from "../edits/panel.js";
import { beginPin, leavePin } from "../edits/pinning.js";
import { FRESH_MS } from "../base/events.js";
import { attempt, showNote } from "../base/messages.js";
import { whileMoving } from "../base/moving.js";
import { t } from "../base/strings.js";
import { valueWords, valuesAt } from "./graphs.js";
import { growingWords, holdsWords } from "./holds.js";
import { addMarker, markerList, placesToSnap, showMarkers, startMarkers, timecodeOf, useMarkers } from "./markers.js";
import { exchangesPending, forgetPerformers, performerButtons, performerList, showPerformers, startPerformers, usePerformers } from "./performers.js";
import { frameWords, nextUnit, unit, unitWords } from "./ruler.js";
import { drawTimeline, frameAt, laneAt, pixelsPerFrame, wordsAt } from "./timeline.js";
import { hold, pan, wheel } from "./pointer.js";
import { trial } from "./trial.js";
import { turns } from "../base/turns.js";
import { followVideo, forgetVideo, paintVideo, startVideo, toggleVideo, videoShown } from "../video/pane.js";
import { startJointClicks } from "../view/joint_click.js";
import { keepInSight, showAll, zoomAbout } from "./zoom.js";

const SPEEDS = [0.1, 0.25, 0.5, 1, 2];
const STALE_MS = 600; // a message of the server may have been on its way for so long

const state = {
  replay: { open: false }, receivedAt: 0, solves: [], curves: null, wanted: "", joint: "LeftHand",
  more: { colours: {}, edits: null, serial: 0 }, // beside the curves: the cameras' colours, the places to mend
  sending: false, sentAt: -Infinity, next: null, listening: () => {}, comparing: () => {},
};

const inTurn = turns();
const asked = (request) => inTurn(() => attempt(request));

/** Whether a take is replayed, and which: the status as last known. */
export const replayed = () => state.replay;

/** The frame that is shown now. */
export function frameNow() {
  const { frame, playing, speed, rate_hz: rate, first, last, loop } = state.replay;
  if (!playing) return frame;
  const ahead = frame + (Math.min(performance.now() - state.receivedAt, FRESH_MS) / 1000) * speed * rate; // no further than is known
  if (ahead <= last) return Math.round(ahead);
  return loop ? first + Math.round(ahead - first) % (last - first + 1) : last;
}

function take(status) {
  state.replay = status;
  state.receivedAt = performance.now();
  show();
}

/** Send a change; changes made while one is on its way are merged and sent next. */
async function send(change) {
  if (state.sending) {
    state.next = { ...state.next, ...change };
    return;
  }
  state.sending = true;
  state.sentAt = performance.now();
  const status = await asked(() => changeReplay(change));
  state.sending = false;
  state.sentAt = performance.now();
  if (status && !state.next) take(status);
  const next = state.next;
  state.next = null;
  if (next) send(next);
}

/** Show a take's solve instead of the live stage; `ghost`: a second `{take, solve, alignment?}` or `{take, reference}` next to it;
 * `performer`: the one whose curves are shown, by default the previous one. */
export async function open(takeId, solve, ghost = null, performer = performerOf(takeId, solve)) {
  const { lined_up: _, ...beside } = ghost ?? {};
  state.sentAt = performance.now();
  const status = await asked(() => openReplay({ take: takeId, solve, ghost: ghost && beside, ...(performer && { performer }) }));
  state.sentAt = performance.now();
  if (status) take(status);
}

/** Reopen what is replayed, because its content changed; it continues at its time. */
const openAgain = () => open(state.replay.take, state.replay.solve, state.replay.ghost);

/** Return the performer whose curves are shown, if a solve of the same take has them too; else null. */
function performerOf(takeId, solve) {
  const { take: shown, performer } = state.replay;
  if (shown !== takeId || !performer) return null;
  return state.solves.some((one) => one.take === takeId && one.solve === solve && one.performers?.includes(performer)) ? performer : null;
}

async function close() {
  const status = await asked(closeReplay);
  if (status) take(status);
}

/** Apply a change here at once, and on the server. */
export function change(values) {
  Object.assign(state.replay, { frame: frameNow() }, values);
  state.receivedAt = performance.now();
  send(values);
}

const toggle = () => send({ playing: !state.replay.playing });

/** Pause, and show a frame. */
export function goTo(frame) {
  const last = state.replay.frames - 1;
  state.replay.frame = Math.min(Math.max(frame, 0), last);
  state.replay.playing = false;
  state.receivedAt = performance.now();
  keepInSight(state.replay.frame, state.replay);
  paint();
  send({ frame: state.replay.frame, playing: false });
}

/** Pin the chosen joint at the playhead. */
function pinChosen() {
  beginPin(state.replay, frameNow(), state.joint);
}

function zoom(notches) {
  zoomAbout(frameNow(), notches, state.replay);
  paint();
}

const KEYS = {
  " ": toggle,
  ArrowLeft: (event) => goTo(frameNow() - (event.shiftKey ? 10 : 1)),
  ArrowRight: (event) => goTo(frameNow() + (event.shiftKey ? 10 : 1)),
  Home: () => goTo(state.replay.first),
  End: () => goTo(state.replay.last),
  l: () => change({ loop: !state.replay.loop }),
  i: () => change({ first: Math.min(frameNow(), state.replay.last) }),
  o: () => change({ last: Math.max(frameNow(), state.replay.first) }),
  "[": () => KEYS.i(),
  "]": () => KEYS.o(),
  m: () => addMarker(state.replay, frameNow()),
  v: () => { toggleVideo(); show(); },
  c: ({ shiftKey }) => state.replay.solve && (shiftKey ? changeCurvesOf(state.joint) : showCurveList(!curveListShown())),
  j: ({ shiftKey }) => chooseJoint(JOINTS.at((JOINTS.indexOf(state.joint) + (shiftKey ? -1 : 1)) % JOINTS.length)),
  "+": () => zoom(3),
  "-": () => zoom(-3),
  0: () => { showAll(state.replay); paint(); },
  p: pinChosen,
  Delete: removeChosen,
  Escape: () => leavePin() || close(),
};

/** Handle a key; return whether it was one of the replay's. */
export function replayKey(event) {
  const handle = KEYS[event.key.length === 1 ? event.key.toLowerCase() : event.key];
  if (!handle || !state.replay.open) return false;
  handle(event);
  return true;
}

async function loadCurves() {
  const wanted = JSON.stringify([state.replay.take, state.replay.solve, state.replay.performer, state.replay.frames, state.joint]);
  if (state.wanted === wanted) return;
  state.wanted = wanted;
  const shown = `${state.replay.take}|${state.replay.solve}|${state.replay.performer}`;
  if (state.more.of !== shown) state.curves = null;
  const found = await attempt(() => Promise.all([getCurves(state.joint), getView()]));
  if (!found || state.wanted !== wanted) return;
  const [curves, { colours }] = found;
  state.curves = curves;
  state.more = { of: shown, colours, edits: state.more.of === shown ? state.more.edits : null, serial: state.more.serial + 1 };
  paint();
}

/** Choose the joint whose curves the timeline shows; `curves`: also add it to the curves of several joints, or remove it from them. */
function chooseJoint(joint, curves = false) {
  state.joint = joint;
  show();
  if (curves) changeCurvesOf(joint);
}

/** Show the places that an animator would have to mend, or hide them. */
async function toggleEdits() {
  const { take: takeId, solve, performer, rate_hz: rate } = state.replay;
  if (!state.curves) return;
  if (state.more.edits) {
    state.more = { ...state.more, edits: null, serial: state.more.serial + 1 };
  } else {
    const [session, name] = takeId.split("/");
    setText(byId("replay-edits"), t("edits.looking"));
    const found = await attempt(() => getCleanup({ session, name }, solve, performer));
    if (found && state.replay.take === takeId && state.replay.solve === solve && state.replay.performer === performer) {
      state.more = { ...state.more, edits: editSpans(found.cleanup_events ?? [], state.curves.start_s, rate), serial: state.more.serial + 1 };
    }
  }
  paint();
}

/** Whether a button's text can be its name: a symbol needs a label. */
const isWord = (text) => /\p{L}/u.test(text);

function choice(id, label, options, value, onchange) {
  return h("select", { id, aria: { label }, title: label, onchange: (event) => onchange(event.currentTarget.value) },
    options.map(([key, text]) => h("option", { value: key, selected: String(key) === String(value) }, text)));
}

function solveChoice() {
  const { take: takeId, solve, ghost } = state.replay;
  const options = state.solves.filter((one) => one.take === takeId).map((one) => [one.solve, one.solve]);
  if (!solve) options.unshift(["", t("replay.raw")]);
  else if (!options.some(([name]) => name === solve)) options.unshift([solve, solve]); // it is still being made
  return choice("replay-solve", t("replay.solve"), options, solve, (value) => open(takeId, value, ghost));
}

function build() {
  const { take: takeId, solve, ghost, playing, loop, speed, of_s: whole } = state.replay;
  const button = (id, text, label, keys, onclick, pressed) => h("button", {
    id, type: "button", class: "small", onclick, title: keys ? `${label} (${keys})` : label,
    aria: { ...(isWord(text) ? {} : { label }), ...(pressed === undefined ? {} : { pressed: String(pressed) }) },
  }, text);
  return [
    h("div", { class: "replay-row" },
      button("replay-start", "|◀", t("replay.first"), "Home", () => goTo(state.replay.first)),
      button("replay-back", "◂", t("replay.back"), "←", () => goTo(frameNow() - 1)),
      button("replay-play", playing ? "❚❚" : "▶", t(playing ? "replay.pause" : "replay.play"), "Space", toggle),
      button("replay-on", "▸", t("replay.on"), "→", () => goTo(frameNow() + 1)),
      button("replay-end", "▶|", t("replay.last"), "End", () => goTo(state.replay.last)),
      button("replay-loop", t("replay.loop"), t("replay.loop"), "L", () => send({ loop: !loop }), loop),
      button("replay-in", t("replay.in"), t("replay.in_hint"), "I", KEYS.i),
      button("replay-out", t("replay.out"), t("replay.out_hint"), "O", KEYS.o),
      choice("replay-speed", t("replay.speed"), SPEEDS.map((value) => [value, `${value}×`]), speed, (value) => send({ speed: Number(value) })),
      h("output", { id: "replay-time", class: "timer small-timer", title: t("replay.clock") }),
      h("span", { class: "spacer" }),
      solveChoice(),
      solve && !whole && button("replay-compare", t("compare.title"), t("compare.hint"), "", () => state.comparing(), false),
      button("replay-close", t("replay.live"), t("replay.live_hint"), "Esc", close)),
    h("div", { class: "replay-row" },
      h("strong", { class: "replay-take", title: state.replay.take }, state.replay.take.split("/").pop()),
      whole && h("span", { id: "replay-growing", class: "fair", role: "status" }, growingWords(state.replay)),
      ...performerButtons(state.replay, frameNow, choice, (value) => open(takeId, solve, ghost, value)),
      choice("replay-joint", t("replay.joint"), [...new Set([...JOINTS, state.joint])].map((name) => [name, name]), state.joint, (value) => chooseJoint(value)),
      solve && h("button", { id: "replay-curves", type: "button", class: "small", title: `${t("graphs.hint")} (C)`, aria: { expanded: String(curveListShown()), controls: "curve-list" },
        onclick: () => KEYS.c({}) }, t("graphs.button")),
      button("replay-video", t("video.title"), t("video.hint"), "V", KEYS.v, videoShown()),
      h("span", { id: "replay-value", class: "count" }),
      trial,
      button("replay-unit", t(`replay.unit.${unit()}`), unitWords(timecodeOf(state.replay.take)), "", () => { nextUnit(timecodeOf(state.replay.take)); paint(); }),
      button("replay-out-zoom", "−", t("replay.zoom_out"), "-", () => zoom(-3)),
      button("replay-in-zoom", "+", t("replay.zoom_in"), "+", () => zoom(3)),
      button("replay-fit", "↔", t("replay.zoom_all"), "0", KEYS[0]),
      button("replay-mark", "◆+", t("markers.add"), "M", KEYS.m),
      button("replay-markers", t("markers.title"), t("markers.hint"), "", () => { markerList.hidden = !markerList.hidden; showMarkers(state.replay, goTo); }),
      solve && !whole && button("replay-edits", t("edits.button"), t("edits.hint"), "", toggleEdits, Boolean(state.more.edits))),
    curveLegend,
    h("div", { class: "timeline" },
      curveList,
      h("canvas", { id: "timeline", tabIndex: 0, role: "slider", aria: { label: t("replay.timeline") }, onpointerdown: press, onpointermove: hover, onpointerleave: hover,
        onwheel: (event) => { wheel(event, state.replay); paint(); } }),
      h("div", { id: "timeline-tip", class: "timeline-tip", aria: { hidden: "true" }, hidden: true })),
    performerList,
    markerList,
  ];
}

const places = () => placesToSnap(state.replay, [...(state.curves?.pops ?? []), ...(state.more.edits ?? [])]);

function press(event) {
  const canvas = event.currentTarget;
  if (event.button === 1 || event.ctrlKey) pan(event, state.replay, paint);
  else if (grab(event, laneAt(canvas, event, state.curves, state.more), { frameAt: (moved) => frameAt(canvas, moved, state.replay, true), perFrame: pixelsPerFrame(canvas, state.replay), frames: state.replay.frames, goTo, paint })) canvas.focus();
  else hold(event, { replay: state.replay, places, goTo, change: (values) => { change(values); paint(); } });
}

/** Show the curves' values under the pointer. */
function hover(event) {
  const tip = byId("timeline-tip"), canvas = byId("timeline");
  tip.hidden = event.type === "pointerleave" || event.buttons > 0 || !state.curves;
  if (tip.hidden) return;
  const frame = frameAt(canvas, event, state.replay, true);
  const { values, spans } = wordsAt(state.curves, state.more, frame);
  const chosen = valuesAt(frame).map(({ colour, words }) => h("span", { class: "curve-words", style: `--curve: var(${colour})` }, words));
  tip.replaceChildren(h("strong", {}, `${frameWords(frame, state.replay, timecodeOf(state.replay.take))}  ${frame}`), ...(chosen.length ? chosen : [h("span", {}, values)]), ...spans.map((words) => h("span", {}, words)));
  const box = canvas.getBoundingClientRect();
  tip.style.left = `${Math.min(Math.max(event.clientX - box.left - tip.offsetWidth / 2, 0), Math.max(box.width - tip.offsetWidth, 0))}px`;
}

/** Draw what changes with every frame. */
function paint() {
  const canvas = byId("timeline");
  if (!canvas || !state.replay.open) return;
  const frame = frameNow();
  const { rate_hz: rate, frames } = state.replay;
  if (state.replay.playing) keepInSight(frame, state.replay);
  setText(byId("replay-time"), `${clock(frame / rate)}  ${frame} / ${frames - 1}`);
  setText(byId("replay-unit"), t(`replay.unit.${unit()}`));
  byId("replay-unit").title = unitWords(timecodeOf(state.replay.take)); // which comes after the replay was opened
  showMarkers(state.replay, goTo);
  showPerformers(state.replay, frameNow);
  byId("replay-performers")?.setAttribute("aria-expanded", String(!performerList.hidden));
  byId("replay-performers")?.classList.toggle("fair", exchangesPending(state.replay));
  loadCurveData(state.replay, frame);
  showLegend((curve) => valueWords(curve, frame));
  canvas.setAttribute("aria-valuenow", String(frame));
  canvas.setAttribute("aria-valuemax", String(frames - 1));
  canvas.setAttribute("aria-valuemin", "0");
  drawTimeline(canvas, state.replay, state.curves, state.more, frame);
  paintVideo(frame);
  byId("replay-value").hidden = !curveLegend.hidden; // its values stand there
  setText(byId("replay-value"), state.replay.holds ? holdsWords(state.replay.holds) : wordsAt(state.curves, state.more, frame).values);
  const { edits } = state.more;
  if (!byId("replay-edits")) return;
  setText(byId("replay-edits"), edits ? t("edits.count", { n: edits.length }) : t("edits.button"));
  byId("replay-edits").setAttribute("aria-pressed", String(Boolean(edits)));
}

const paintOn = whileMoving(() => state.replay.open && state.replay.playing, paint);

function show() {
  const { open: isOpen, take: takeId, solve, ghost, playing, loop, speed, of_s: whole } = state.replay;
  document.body.classList.toggle("replaying", isOpen);
  byId("replay").hidden = !isOpen;
  followVideo(state.replay);
  if (isOpen) {
    setText(byId("replay-title"), solve ? t("replay.title", { take: takeId, solve }) : t("replay.raw_title", { take: takeId }));
    redraw(byId("replay-bar"), [takeId, solve, ghost, playing, loop, speed, state.joint, state.solves, whole && growingWords(state.replay), videoShown(), state.replay.performer, state.replay.performers], build);
    loadCurves();
    useMarkers(takeId);
    usePerformers(state.replay);
    besideIs(Boolean(ghost));
    if (!solve) showCurveList(false);
    paint();
  } else {
    state.wanted = "";
    showCurveList(false);
  }
  paintOn();
  state.listening(state.replay);
}

/** Handle the server's message about the replay. */
export function updateReplay(status) {
  if (state.sending || performance.now() - state.sentAt < STALE_MS) return; // said before our own change was heard
  take(status);
}

/** Update what can be shown from the list of takes. */
export function updateReplayTakes(takes) {
  state.solves = takes.flatMap((one) => one.solves.map((solve) => ({ take: one.id, solve, performers: one.performers })));
  if (state.replay.open) show();
}

/** Handle a solve that has ended: show it if its take is replayed. */
export function solved(takeId, solve) {
  if (!state.replay.open || state.replay.take !== takeId) return;
  state.wanted = ""; // the solve may be a new one of an old name
  forgetCurveData();
  forgetVideo();
  forgetPerformers();
  forgetSolved();
  offersAgain(state.replay);
  open(takeId, solve, state.replay.ghost);
  showNote(t("replay.showing", { solve }));
}

/** Start; `listen` gets the replay's status whenever it changes, `compare` opens the compare view. */
export function startReplay(listen, compare) {
  state.listening = listen;
  state.comparing = compare;
  startMarkers(paint);
  startPerformers(paint, openAgain);
  startCurveChoice(paint);
  startCurveData(paint);
  startVideo();
  startEdits({ goTo, pin: pinChosen, painted: paint });
  startBodies(openAgain);
  startJointClicks(() => (state.replay.open && state.replay.solve ? frameNow() : null), JOINTS, chooseJoint);
  new ResizeObserver(paint).observe(byId("replay"));
  window.addEventListener("language", show);
}
