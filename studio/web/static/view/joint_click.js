// A click on a joint of the replayed character in the 3D view.
import { getReplayJoints } from "../base/api.js";
import { byId, h } from "../base/dom.js";
import { project } from "./framing.js";
import { listenInside } from "./viewer.js";
import { lookNow } from "./viewpoint.js";

const STILL_PX = 5; // a pointer that moves further turns the view
const REACH_PX = 26, REACH_M = 0.12; // so near to a joint a click is meant for it
const BEHIND_PX = 10; // joints that are not first ones, such as fingers, count as so much further away
const SHOWN_MS = 1500;

const name = h("p", { id: "joint-name", class: "joint-name", role: "status", hidden: true });
let down = null;
let timer = 0;
let before = Promise.resolve(); // clicks are answered in their order

/** Return the joint nearest to a place in the view [px], and where it is; undefined if none is near. */
function nearestJoint(places, first, [x, y], look) {
  const { clientWidth: width, clientHeight: height } = byId("viewer");
  const seen = Object.entries(places).flatMap(([joint, place]) => {
    const at = project(place, look, height);
    if (!at) return [];
    const px = [width / 2 + at.x, height / 2 + at.y], off = Math.hypot(px[0] - x, px[1] - y);
    return off < Math.max(REACH_PX, REACH_M * at.metre) ? [{ joint, px, apart: off + (first.includes(joint) ? 0 : BEHIND_PX) }] : [];
  });
  return seen.sort((one, other) => one.apart - other.apart)[0];
}

function show({ joint, px: [x, y] }) {
  name.textContent = joint;
  name.hidden = false;
  name.style.left = `${x}px`;
  name.style.top = `${y}px`;
  clearTimeout(timer);
  timer = setTimeout(() => { name.hidden = true; }, SHOWN_MS);
}

const isClick = (from, to) => from && to.button === 0 && Math.hypot(to.clientX - from.x, to.clientY - from.y) < STILL_PX;

/** Start; `frameNow` returns the shown frame, or null; `first`: joints that take precedence; `chosen` gets a joint, and whether
 * Shift was held. */
export function startJointClicks(frameNow, first, chosen) {
  byId("viewer").after(name);
  listenInside("pointerdown", ({ button, clientX: x, clientY: y }) => { down = button === 0 ? { x, y } : null; });
  listenInside("pointerup", (event) => {
    const frame = frameNow(), look = lookNow();
    if (frame === null || !look || !isClick(down, event)) return;
    const { clientX, clientY, shiftKey } = event;
    const asked = getReplayJoints(frame).catch(() => ({ positions_m: {} })); // closed by now
    const answer = async () => {
      const { positions_m: places } = await asked;
      const found = nearestJoint(places, first, [clientX, clientY], look);
      if (!found) return;
      show(found);
      chosen(found.joint, shiftKey);
    };
    before = before.then(answer, answer); // also after one that failed
  });
}
