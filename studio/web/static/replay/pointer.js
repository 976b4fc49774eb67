// The pointer on the timeline: it moves the playhead, on the ruler the range; the middle button, Ctrl and the wheel move the visible part.
import { frameAt, onRuler, pixelsPerFrame } from "./timeline.js";
import { panBy, shownPart, snapped, zoomAbout } from "./zoom.js";

const GRIP_PX = 8;

/** Call `move` with the pointer's moves until it is released. */
function follow(event, move) {
  const canvas = event.currentTarget;
  canvas.setPointerCapture(event.pointerId);
  canvas.addEventListener("pointermove", move);
  canvas.addEventListener("pointerup", () => canvas.removeEventListener("pointermove", move), { once: true });
}

/** Drag the playhead, or on the ruler the range: the end nearest to the pointer if it is on one, else a new range. Alt: without snapping. */
export function hold(event, { replay, places, goTo, change }) {
  const canvas = event.currentTarget, perFrame = pixelsPerFrame(canvas, replay);
  const at = (moved) => {
    const frame = frameAt(canvas, moved, replay, true);
    return moved.altKey ? frame : snapped(frame, places(), perFrame);
  };
  if (!onRuler(canvas, event)) {
    goTo(at(event));
    follow(event, (moved) => goTo(at(moved)));
    return;
  }
  const begun = frameAt(canvas, event, replay, true);
  const { first, last } = replay;
  const [toFirst, toLast] = [first, last].map((frame) => Math.abs(frame - begun) * perFrame);
  const other = Math.min(toFirst, toLast) > GRIP_PX ? begun : toFirst < toLast ? last : first;
  follow(event, (moved) => {
    const frame = at(moved);
    if (frame !== other) change({ first: Math.min(frame, other), last: Math.max(frame, other) });
  });
}

/** Drag the visible part. */
export function pan(event, replay, paint) {
  event.preventDefault();
  const canvas = event.currentTarget;
  let x = event.clientX;
  follow(event, (moved) => {
    const { from, to } = shownPart(replay);
    panBy((x - moved.clientX) / pixelsPerFrame(canvas, replay) / (to - from), replay);
    x = moved.clientX;
    paint();
  });
}

/** Zoom about the pointer; sideways, or with Shift, pan. */
export function wheel(event, replay) {
  event.preventDefault();
  const sideways = event.shiftKey ? event.deltaY : event.deltaX;
  if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) panBy(Math.sign(sideways) * 0.1, replay);
  else zoomAbout(frameAt(event.currentTarget, event, replay, true), -Math.sign(event.deltaY) * 2, replay);
}
