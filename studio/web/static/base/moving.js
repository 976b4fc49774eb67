// Painting only while something moves: an animation frame has a cost even if nothing changes in it.
const PICTURE_MS = 1000 / 30 - 4; // a display's frames come a little early or late

/** Call `paint` 30 times a second while `moves()`; return the function to call when movement may have begun. */
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
