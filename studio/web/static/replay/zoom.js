// The part of the take that the timeline shows, and the places to which the playhead snaps.
const LEAST = 20; // frames that are shown at least
const STEP = 1.2; // a wheel's notch
const SNAP_PX = 7;

const view = { of: "", from: 0, to: 1 };

/** Return the first and last visible frame; another take or solve is shown whole at first. */
export function shownPart({ take, solve, frames }) {
  const of = `${take}|${solve}|${frames}`;
  if (view.of !== of) Object.assign(view, { of, from: 0, to: Math.max(frames - 1, 1) });
  return view;
}

function put(from, width, frames) {
  const whole = Math.max(frames - 1, 1), span = Math.min(Math.max(width, Math.min(LEAST, whole)), whole);
  view.from = Math.min(Math.max(from, 0), whole - span);
  view.to = view.from + span;
}

/** Zoom in (`notches` > 0) or out about a frame that stays where it is. */
export function zoomAbout(frame, notches, replay) {
  const { from, to } = shownPart(replay);
  const factor = STEP ** -notches;
  put(frame - (frame - from) * factor, (to - from) * factor, replay.frames);
}

/** Pan by a share of the visible part. */
export function panBy(share, replay) {
  const { from, to } = shownPart(replay);
  put(from + share * (to - from), to - from, replay.frames);
}

/** Show the whole take. */
export const showAll = (replay) => { shownPart(replay); put(0, Infinity, replay.frames); };

/** Bring a frame into sight: the visible part turns over like a page. */
export function keepInSight(frame, replay) {
  const { from, to } = shownPart(replay);
  if (frame < from || frame > to) put(frame - 0.1 * (to - from), to - from, replay.frames);
}

/** Return the nearest place if it is within a few pixels of a frame, else the frame; `perFrame`: pixels per frame. */
export function snapped(frame, places, perFrame) {
  const nearest = places.reduce((best, place) => (Math.abs(place - frame) < Math.abs(best - frame) ? place : best), Infinity);
  return Math.abs(nearest - frame) * perFrame <= SNAP_PX ? nearest : frame;
}
