// What is painted while something moves, and not at all otherwise: an animation frame costs, also where nothing changed in it.
const PICTURE_MS = 1000 / 30 - 4; // a display's frames come a little early or late

/** Have `paint` be called 30 times a second for as long as `moves()`; return what is to be called when that may have begun. */
export function whileMoving(moves, paint) {
  let asked = false, painted = -Infinity;
  function next(time) {
    asked = false;
    if (!moves()) return;
    if (time - painted >= PICTURE_MS) {
      painted = time;
      paint();
    }
    begin();
  }
  function begin() {
    if (asked || !moves()) return;
    asked = true;
    requestAnimationFrame(next);
  }
  return begin;
}
