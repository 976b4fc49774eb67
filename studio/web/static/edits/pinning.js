// Pinning a joint in the 3D view: arrows at it are dragged to where the joint really was.
import { getGizmo, getReplayJoints, hideGizmo, showGizmo } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { listenInside } from "../view/viewer.js";
import { add, expectLook } from "./list.js";
import { stageOf } from "./time.js";
import { OUTPUT, canonicalOf } from "./words.js";

export const RADIUS_M = 0.02; // as well as a person sees where a joint is
const ASKED_MS = 15, TRIES = 40; // the view tells the server of a drag a moment after the pointer is let go
const state = { pin: null, frame: 0, changed: () => {} }; // the pin that is being made: {joint, start_s, end_s, performer}

/** Return the joint being pinned, or null. */
export const pinned = () => state.pin?.joint ?? null;

/** Show the arrows at a joint (name of an output joint) of the replay at a frame. */
export async function beginPin(replay, frame, joint) {
  if (!replay.open || !replay.solve || replay.playing) return;
  const canonical = canonicalOf(joint), time_s = stageOf(frame / replay.rate_hz);
  const shown = await attempt(async () => {
    const { positions_m: places } = await getReplayJoints(frame);
    return showGizmo(places[OUTPUT[canonical]]);
  });
  if (!shown) return;
  expectLook(replay);
  state.pin = { kind: "pin", joint: canonical, start_s: time_s, end_s: time_s, radius_m: RADIUS_M, ...(replay.performer && { performer: replay.performer }) };
  state.frame = frame;
  state.changed();
}

/** Cancel pinning if another frame is shown, or the replay plays or is closed. */
export function checkPin({ open, playing, frame }) {
  if (state.pin && (!open || playing || frame !== state.frame)) leavePin();
}

/** Cancel pinning, the joint stays as it is; return whether one was being pinned. */
export function leavePin() {
  if (!state.pin) return false;
  state.pin = null;
  state.changed();
  attempt(hideGizmo);
  return true;
}

const soon = () => new Promise((resolve) => { setTimeout(resolve, ASKED_MS); });

/** Handle that the pointer was released in the view: if the arrows were dragged, pin the joint there. */
async function letGo() {
  const { pin } = state;
  for (let k = 0; pin && state.pin === pin && k < TRIES; k += 1) {
    const gizmo = await getGizmo().catch(() => null);
    if (state.pin !== pin) return;
    if (gizmo?.drags > 0) {
      state.pin = null;
      state.changed();
      attempt(hideGizmo);
      add({ ...pin, place_m: gizmo.place_m.map((one) => Number(one.toFixed(4))) });
      return;
    }
    await soon();
  }
}

/** Start; `changed` is called when the pin changes. */
export function startPinning(changed) {
  state.changed = changed;
  listenInside("pointerup", letGo);
}
