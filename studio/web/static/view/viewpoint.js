// Where this browser's 3D view looks from: a place, by hand, or where the operator's view looks from. Each tab keeps its own, over
// a reload and a restart of the server. The part inside the view is `view_camera.js`.
import { getSpace } from "../base/api.js";
import { byId } from "../base/dom.js";
import { add, length, middle, sub, turned, wholeMotion, wholePerformers, wholeStage, widened } from "./framing.js";
import { closeOperatorView, isOperatorView, tellOperatorView } from "./operator_view.js";

/** Places that move the camera until another one is chosen. */
export const GOING = ["orbit", "follow"];

const KEPT = "viewpoint";
const OFFSETS = { front: [0, -4.6, 0.45], side: [4.6, 0, 0.45], top: [0, -0.02, 5.6], orbit: [0, -4.6, 0.55] };
const LOOK_HEIGHT = 0.9;
const TURN_MS = 24_000;
const PICTURE_MS = 1000 / 30;
const LONGEST_MS = 200; // a tab that was hidden does not catch up
const WIDER_M = 0.25; // performers who come together or part by more are fitted into the picture anew
const SAME_M = 0.002, FAR_M = 0.01, SAME_ASPECT = 0.02;
const TRIES = 5; // the view sets its own first look a moment after it has begun

// Kept: `place`; `look`; `following`: the operator's view is followed; `source`: this is the operator's view itself; `take`: the
// replayed one; `at`: the middle of the performers when the camera last followed them; `wide`: how far they stood apart when they
// were last fitted into the picture; `fitted`: the stage or motion that was last fitted into the picture, and the picture's shape.
const state = { place: "stage", look: null, following: false, source: false, take: "", at: null, wide: 0, fitted: null, ...JSON.parse(sessionStorage.getItem(KEPT) ?? "{}") };
const seen = { aspect: 1, cameras: new Map(), places: new Map(), operator: null, points: null }; // as the view and the server say
const link = { ready: false, known: false, order: 0, chosen: 0, tries: 0, holding: false }; // with the view; `known`: the server said who asks
let asked = null; // the take whose motion was asked for
let turnedAt = 0;
let changed = () => {};

/** State that the page shows: the place, and whether the operator's view is followed, is this one, or exists at all. */
export const viewpoint = () => ({ place: state.place, following: state.following, source: state.source, known: link.known, operator: Boolean(seen.operator) });

/** Where this browser looks from, `{position, target}`; null before the view is there. */
export const lookNow = () => state.look;

function keep() {
  sessionStorage.setItem(KEPT, JSON.stringify(state));
  changed();
}

function send() {
  if (link.ready) byId("viewer").contentWindow.postMessage({ type: "look", ...state.look, order: link.order }, location.origin);
}

function move({ position, target }, moved = false) {
  state.look = { position, target };
  link.order += 1;
  link.tries = 0;
  send();
  keep();
  publish(moved);
}

/** Report to the server where this page looks from, if that may be the operator's view. */
function publish(moved) {
  if (!link.known || !state.look || state.following || !(moved || state.source || !seen.operator)) return;
  tellOperatorView({ ...state.look, aspect: seen.aspect }, moved, setSource);
}

function setSource(source) {
  if (state.source === source) return;
  state.source = source;
  keep();
}

const performers = () => [...seen.places.values()];
const centre = () => [...middle(performers()), LOOK_HEIGHT];
/** Largest distance of a performer from their middle [m]. */
const width = () => Math.max(0, ...performers().map((place) => length(sub(place, middle(performers())))));
const sameShape = (a, b) => Math.max(a / b, b / a) - 1 < SAME_ASPECT;

/** Fit all that is looked at into the picture, again if that or the picture's shape has changed. */
function frame(moved = false, anyway = moved) {
  const motion = state.place === "motion";
  if (!link.ready || state.following || !(motion || state.place === "stage")) return;
  if (motion ? !seen.points : !seen.cameras.size && !anyway) return;
  const what = JSON.stringify(motion ? state.take : [...seen.cameras].sort());
  if (state.fitted?.what === what && sameShape(state.fitted.aspect, seen.aspect)) return;
  state.fitted = { what, aspect: seen.aspect };
  move(motion ? wholeMotion(seen.points, seen.aspect) : wholeStage([...seen.cameras.values()], performers(), seen.aspect), moved);
}

function goAlong(moved = false) {
  if (!link.ready || !state.look || !seen.places.size || state.following || state.place !== "follow") return;
  const at = centre(), wide = width(), before = state.at, { position, target } = state.look;
  const goOn = before && Math.abs(wide - state.wide) < WIDER_M;
  if (before && (link.holding || (goOn && length(sub(at, before)) < SAME_M))) return;
  state.at = at;
  if (!goOn) state.wide = wide;
  if (goOn) move({ position: add(position, sub(at, before)), target: add(target, sub(at, before)) });
  else move(wholePerformers(performers(), sub(position, target), seen.aspect), moved);
}

function turn(time) {
  if (state.place !== "orbit") return;
  requestAnimationFrame(turn);
  const passed = time - turnedAt;
  if (passed < PICTURE_MS) return;
  turnedAt = time;
  if (!state.look || !link.ready) return;
  const at = centre(), position = add(state.look.position, sub(at, state.look.target));
  move(turned({ position, target: at }, (2 * Math.PI * Math.min(passed, LONGEST_MS)) / TURN_MS));
}

const apart = (a, b) => Math.max(length(sub(a.position, b.position)), length(sub(a.target, b.target)));

function copyOperator() {
  if (!state.following || !seen.operator || !link.ready) return;
  const wanted = widened(seen.operator, seen.aspect);
  if (apart(wanted, state.look) > 0) move(wanted);
}

/** Look from a place; one of `GOING` ends when it is chosen again. */
export function lookFrom(name) {
  if (name === "motion" && !seen.points) return;
  const place = GOING.includes(name) && state.place === name ? "free" : name;
  const begins = place === "orbit" && state.place !== "orbit";
  Object.assign(state, { place, following: false, at: null, fitted: null });
  if (OFFSETS[place]) move({ position: add(centre(), OFFSETS[place]), target: centre() }, true);
  if (begins) requestAnimationFrame(turn);
  keep();
  frame(true);
  goAlong(true);
  link.chosen = link.order;
}

/** Follow the operator's view, or stop; it also ends when the user looks elsewhere. */
export function followOperator(following) {
  Object.assign(state, { following, place: "free", at: null });
  keep();
  copyOperator();
  link.chosen = link.order;
}

/** Whether a camera move by the user counts: not one from before a choice, nor, when following, from before the last look. */
const isWanted = (order) => (state.place === "follow" ? order === link.order : order >= link.chosen);

/** Handle the view's report of its camera; `first`: the look that it begins with. */
function hearCamera({ position, target, aspect, byHand, order, first }) {
  seen.aspect = aspect || seen.aspect;
  const now = { position, target };
  const off = state.look ? apart(now, state.look) : 0;
  if (!link.ready) {
    link.ready = true;
    move(state.look ?? first);
  } else if (byHand && isWanted(order) && off > SAME_M / 2) {
    Object.assign(state, { look: now, following: false, place: state.place === "follow" ? "follow" : "free" });
    keep();
    publish(true);
  } else if (!byHand && order === link.order && off > FAR_M && !GOING.includes(state.place) && link.tries < TRIES) {
    link.tries += 1;
    send();
  }
  frame();
  goAlong();
  copyOperator();
}

function hearScene(told) {
  for (const [name, value] of Object.entries(told)) {
    if (name.startsWith("/places/")) {
      if (value?.[2]) seen.places.set(name, value.slice(0, 2));
      else seen.places.delete(name);
    }
    if (!name.endsWith("/frustum")) continue;
    if (value) seen.cameras.set(name, value);
    else seen.cameras.delete(name);
  }
  if (told["/operator/page"]?.[0]) {
    const [page, aspect] = told["/operator/page"];
    seen.operator = { position: told["/operator/from"], target: told["/operator/at"], aspect };
    setSource(isOperatorView(page));
    changed();
    copyOperator();
  } else if ("/operator/page" in told) { // its page was closed
    seen.operator = null;
    changed();
    publish(state.source);
  }
  frame();
  goAlong();
}

function hear({ origin, source, data }) {
  if (origin !== location.origin || source !== byId("viewer").contentWindow) return;
  if (data.type === "camera") hearCamera(data);
  else if (data.type === "scene") hearScene(data.told);
  else if (data.type === "holding") {
    link.holding = data.holding;
    goAlong();
  } else if (data.type === "begun") {
    link.ready = false;
    Object.assign(seen, { cameras: new Map(), places: new Map(), operator: null });
    changed();
  }
}

/** Look at the whole motion of a take that is opened, and again at the stage once it is closed. */
export async function seeReplay(replay) {
  const take = replay.open ? replay.take : "";
  if (take === asked) return;
  asked = take;
  seen.points = null;
  const points = take ? (await getSpace().catch(() => null))?.points_m : null;
  if (take !== asked) return; // another one by now
  seen.points = points;
  if (take !== state.take) {
    Object.assign(state, { take, fitted: null });
    if (state.place === "follow") state.at = null;
    else if (take && !state.following) state.place = "motion";
    if (!take && state.place === "motion") state.place = "stage";
    keep();
  }
  frame(false, true);
  goAlong();
}

/** The server is there (again), and has reported this browser's role. */
export function announce() {
  link.known = true;
  publish(state.source);
  changed();
}

/** Start; `onChange` is called when `viewpoint()` may have changed. */
export function startViewpoint(onChange) {
  changed = onChange;
  window.addEventListener("message", hear);
  byId("viewer").contentWindow.postMessage({ type: "hello" }, location.origin);
  window.addEventListener("pagehide", closeOperatorView);
  window.addEventListener("pageshow", ({ persisted }) => { if (persisted) publish(state.source); });
  if (state.place === "orbit") requestAnimationFrame(turn);
  changed();
}
