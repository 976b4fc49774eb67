// Which part of the take the timeline shows, and which places draw the playhead to them.
const LEAST = 20; // frames that are shown at least
const STEP = 1.2; // a wheel's notch
const SNAP_PX = 7;

const view = { of: "", from: 0, to: 1 };

/** The first and last frame that are shown; all of another take or solve at first. */
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

/** Show less (`notches` > 0) or more about a frame that stays where it is. */
export function zoomAbout(frame, notches, replay) {
  const { from, to } = shownPart(replay);
  const factor = STEP ** -notches;
  put(frame - (frame - from) * factor, (to - from) * factor, replay.frames);
}

/** Move on by a share of what is shown. */
export function panBy(share, replay) {
  const { from, to } = shownPart(replay);
  put(from + share * (to - from), to - from, replay.frames);
}

/** Show all of it. */
export const showAll = (replay) => { shownPart(replay); put(0, Infinity, replay.frames); };

/** Have a frame be in sight: the part turns over like a page. */
export function keepInSight(frame, replay) {
  const { from, to } = shownPart(replay);
  if (frame < from || frame > to) put(frame - 0.1 * (to - from), to - from, replay.frames);
}

/** Return the place that is within a few pixels of a frame, else the frame; `perFrame`: pixels. */
export function snapped(frame, places, perFrame) {
  const nearest = places.reduce((best, place) => (Math.abs(place - frame) < Math.abs(best - frame) ? place : best), Infinity);
  return Math.abs(nearest - frame) * perFrame <= SNAP_PX ? nearest : frame;
}
