// Points of the depth cameras: their colour, a switch for each camera, and how many of them reach this browser.
import { byId, h, setText } from "../base/dom.js";
import { number, t } from "../base/strings.js";

const KEPT_S = 2; // messages that the figures are of
const SHORTEST_S = 0.5;
const STILL_S = 0.7; // without a message for so long, nothing moves
const SHOW_MS = 500;

const now = () => (performance.timeOrigin + performance.now()) / 1000;
const state = { view: null, counts: {}, batches: [] };

/** Return the choice of colour and of cameras, for the menu of layers; `change` changes the view. */
export function pointsChoice({ points, colours }, change) {
  const button = (id, text, pressed, onclick, style) => h("button", { type: "button", id, class: "chip-button", style, onclick, aria: { pressed: String(pressed) } }, text);
  return h("div", { class: "points-choice", role: "group", aria: { label: t("points.group") } },
    points.colours.map((name) => button(`points-by-${name}`, t(`points.by.${name}`), points.colour === name, () => change({ points: { colour: name } }))),
    Object.entries(points.cameras).map(([name, { shown }]) => button(`points-of-${name}`, name, shown,
      () => change({ points: { cameras: { [name]: !shown } } }), `--camera: ${colours[name] ?? "currentColor"}`)));
}

/** Return sentences on why there are no points, or not from every camera. */
function reasons({ points }) {
  const replaying = document.body.classList.contains("replaying");
  if (points.problem) return [t(`points.${points.problem}`)];
  const cameras = Object.entries(points.cameras);
  if (!cameras.length) return [t(replaying ? "points.none_in_take" : "points.none_live")];
  return cameras.filter(([, { says }]) => says).map(([name, { says }]) => t(`points.${says}`, { camera: name }));
}

/** Return how many points are shown, and their frame rate and data rate [MB/s] over the last seconds. */
export function figures() {
  const points = Object.values(state.counts).reduce((sum, count) => sum + count, 0);
  state.batches = state.batches.filter(({ came }) => came > now() - KEPT_S);
  const { batches } = state, newest = batches.at(-1);
  const seconds = newest ? newest.came - batches[0].came : 0;
  if (seconds < SHORTEST_S || now() - newest.came > STILL_S) return { points };
  return { points, fps: (batches.length - 1) / seconds, rate: batches.slice(1).reduce((sum, { bytes }) => sum + bytes, 0) / seconds / 1e6 };
}

function show() {
  const said = byId("points-said");
  said.hidden = !state.view?.layers.points.shown;
  if (said.hidden) return;
  const { points, fps, rate } = figures();
  const count = points ? t("points.count", { n: number(points) }) : "";
  const words = fps ? t("points.figures", { count, fps: number(fps), rate: number(rate, 1) }) : count;
  setText(said, [words, ...reasons(state.view)].filter(Boolean).join(" \u00b7 "));
  said.title = t(document.body.classList.contains("replaying") ? "points.hint" : "points.hint_live");
}

/** Update to the server's state of the view. */
export function updatePoints(view) {
  state.view = view;
  show();
}

/** Listen for points received by the 3D view. */
export function startPoints() {
  window.addEventListener("message", ({ origin, data }) => {
    if (origin !== location.origin || data?.type !== "points") return;
    Object.assign(state.counts, data.counts);
    if (data.bytes) state.batches.push(data);
  });
  byId("viewer").addEventListener("load", () => { state.counts = {}; });
  setInterval(show, SHOW_MS);
}
