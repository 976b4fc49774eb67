// Markers of the replayed take: named instants, kept with the take; each change can be undone.
import { byId, h, redraw } from "../base/dom.js";
import { changeTake, getTakeDetail } from "../base/api.js";
import { attempt, showUndo, undoing } from "../base/messages.js";
import { t } from "../base/strings.js";

const MAX_NAME = 60;
const state = { take: "", list: [], timecode: "", changed: () => {} };

const named = (takeId) => ({ session: takeId.slice(0, takeId.indexOf("/")), name: takeId.slice(takeId.indexOf("/") + 1) });

/** The markers `{time_s, name}` of the replayed take, in order, and its `timecode`: as received, or the time of day at its start, or "". */
export const markersOf = (takeId) => (state.take === takeId ? state.list : []);
export const timecodeOf = (takeId) => (state.take === takeId ? state.timecode : "");

/** Return the markers within a solve: `{frame, name}`. */
export const markedFrames = ({ take, begins_s: begins, rate_hz: rate, frames }) => markersOf(take)
  .map(({ time_s: time, name }) => ({ frame: Math.round((time - begins) * rate), name })).filter(({ frame }) => frame >= 0 && frame < frames);

/** Frames to which playhead and range snap: both ends, the range's, markers, and where spans begin. */
export const placesToSnap = (replay, spans) => [0, replay.frames - 1, replay.first, replay.last,
  ...markedFrames(replay).map(({ frame }) => frame), ...spans.map(([begin]) => begin)];

async function put(takeId, markers) {
  await changeTake(named(takeId), { markers });
  if (state.take === takeId) state.list = [...markers].sort((a, b) => a.time_s - b.time_s);
  state.changed();
}

const RESTORE = undoing("markers", (takeId, markers) => attempt(() => put(takeId, markers)));

function change(takeId, markers, words) {
  const before = state.list;
  return attempt(async () => {
    await put(takeId, markers);
    showUndo(words, RESTORE, takeId, before);
  });
}

/** Set which take is replayed, and request its markers. */
export async function useMarkers(takeId) {
  if (state.take === takeId) return;
  Object.assign(state, { take: takeId, list: [], timecode: "" });
  const found = await attempt(() => getTakeDetail(named(takeId)));
  if (!found || state.take !== takeId) return;
  Object.assign(state, { list: found.meta.markers ?? [], timecode: found.timecode ?? found.meta.timecode ?? "" });
  state.changed();
}

/** Add a marker at a frame, named by its number. */
export function addMarker({ take, begins_s: begins, rate_hz: rate }, frame) {
  if (state.take !== take) return;
  const names = new Set(state.list.map((one) => one.name));
  let number = state.list.length + 1;
  while (names.has(t("markers.number", { number }))) number += 1;
  const name = t("markers.number", { number });
  change(take, [...state.list, { time_s: Number((begins + frame / rate).toFixed(4)), name }], t("markers.added", { name }));
}

function row(marker, i, replay, goTo) {
  const frame = Math.round((marker.time_s - replay.begins_s) * replay.rate_hz);
  const others = state.list.filter((one) => one !== marker);
  const rename = (event) => {
    const name = event.currentTarget.value.trim();
    if (name && name !== marker.name) change(replay.take, [...others, { ...marker, name }], t("markers.renamed", { name }));
  };
  return h("li", {},
    h("button", { class: "small", type: "button", onclick: () => goTo(frame), title: t("markers.go", { name: marker.name }) }, t("markers.at", { frame })),
    h("input", { id: `marker-${i}`, type: "text", value: marker.name, maxLength: MAX_NAME, aria: { label: t("markers.name") }, onchange: rename }),
    h("button", { class: "small square quiet", type: "button", onclick: () => change(replay.take, others, t("markers.removed", { name: marker.name })),
      aria: { label: t("markers.remove", { name: marker.name }) } }, "×"));
}

/** The list of markers, which the button over the timeline opens. */
export const markerList = h("ul", { id: "marker-list", class: "marker-list", hidden: true });

/** Redraw the list if it changed. */
export function showMarkers(replay, goTo) {
  const button = byId("replay-markers");
  if (!button) return;
  button.setAttribute("aria-expanded", String(!markerList.hidden));
  redraw(markerList, [replay.take, replay.begins_s, replay.rate_hz, state.list], () => (state.list.length
    ? state.list.map((marker, i) => row(marker, i, replay, goTo))
    : h("li", { class: "empty" }, t("markers.none"))));
}

/** Start; `changed` is called on other markers. */
export function startMarkers(changed) {
  state.changed = changed;
}
