// Pinning a joint in a camera's picture: its dot in the drawn skeleton is dragged to where the joint really was.
import { getReplayJoints, getVideoPlace } from "../base/api.js";
import { byId } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { canOperate } from "../base/role.js";
import { t } from "../base/strings.js";
import { drawDragged, pointOf } from "../video/drawing.js";
import { repaintVideo, shownPicture } from "../video/pane.js";
import { add, change, expectLook } from "./list.js";
import { RADIUS_M } from "./pinning.js";
import { editList } from "./state.js";
import { CANONICAL } from "./words.js";

const GRAB_PX = 14, MOVED_PX = 3;
const SAME_S = 0.04; // a pin of the joint that is no further away in time is moved: so two cameras place a joint
const state = { drag: null }; // {joint, output, from, to, picture}

const apart = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

const sharesOf = (point, place) => [(point[0] - place.left) / place.width, (point[1] - place.top) / place.height];
const isInside = (point, place) => sharesOf(point, place).every((share) => share >= 0 && share <= 1);

/** Return the picture in which a joint can be grabbed, or null. */
function ready() {
  const { replay } = editList();
  return canOperate() && replay.open && replay.solve && !replay.playing ? shownPicture() : null;
}

/** Return the joint of the skeleton nearest to the pointer, within `GRAB_PX`, or null. */
function jointAt(picture, point) {
  let found = null, least = GRAB_PX;
  picture.names.forEach((output, k) => {
    const at = output in CANONICAL ? pointOf(picture.joints, k, picture.place) : null;
    if (!at || !isInside(at, picture.place) || apart(at, point) > least) return;
    least = apart(at, point);
    found = { joint: CANONICAL[output], output, from: at };
  });
  return found;
}

function move(event) {
  const canvas = event.currentTarget, point = [event.offsetX, event.offsetY];
  if (state.drag) {
    state.drag.to = point;
    repaintVideo();
    drawDragged(canvas, state.drag.from, point);
    return;
  }
  const picture = ready(), found = picture && jointAt(picture, point);
  canvas.style.cursor = found ? "grab" : "";
  canvas.title = found ? t("video.pin_hint", { joint: t(`joint.${found.joint}`) }) : "";
}

function grab(event) {
  const picture = event.button === 0 ? ready() : null, found = picture && jointAt(picture, [event.offsetX, event.offsetY]);
  if (!found) return;
  event.preventDefault();
  event.currentTarget.setPointerCapture(event.pointerId);
  state.drag = { ...found, to: found.from, picture };
  expectLook(editList().replay);
}

/** Cancel the drag; the joint stays as it is. */
function leave() {
  if (!state.drag) return;
  state.drag = null;
  repaintVideo();
}

async function letGo() {
  const { drag } = state;
  if (!drag) return;
  leave();
  const { picture, joint, output, from, to } = drag, { replay } = editList();
  if (apart(from, to) < MOVED_PX || !isInside(to, picture.place)) return;
  const shares = sharesOf(to, picture.place);
  const whose = replay.performer || "performer_1";
  await attempt(async () => {
    const { positions_m: solved } = await getReplayJoints(picture.frame);
    const first = await getVideoPlace(picture.camera, picture.number, shares, solved[output]);
    const before = editList().edits.find((one) => one.kind === "pin" && one.joint === joint && one.performer === whose
      && one.start_s === one.end_s && Math.abs(one.start_s - first.time_s) < SAME_S);
    const found = before ? await getVideoPlace(picture.camera, picture.number, shares, before.place_m) : first;
    const place_m = found.place_m.map((one) => Number(one.toFixed(4)));
    if (before) await change(before, { place_m });
    else await add({ kind: "pin", joint, start_s: found.time_s, end_s: found.time_s, radius_m: RADIUS_M, place_m, ...(replay.performer && { performer: replay.performer }) });
  });
}

/** Start. */
export function startPicturePins() {
  const canvas = byId("video-canvas");
  for (const [kind, act] of Object.entries({ pointermove: move, pointerdown: grab, pointerup: letGo, pointercancel: leave })) canvas.addEventListener(kind, act);
  window.addEventListener("keydown", (event) => {
    if (!state.drag || event.key !== "Escape") return;
    event.stopImmediatePropagation();
    leave();
  }, { capture: true });
}
