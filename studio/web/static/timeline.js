// Draws the timeline: a joint's curves, which cameras were used, standing feet, spikes, edits, the range, the playhead.
import { prepare } from "./canvas.js";
import { lanesOf, seriesNow, spansNow, tracksOf } from "./curves.js";
import { t } from "./strings.js";

const MARGIN = 6;
const GUTTER = 96; // room for labels, where there is some
const WIDE = 700;
const TOP = 4;
const LANE = 12; // a lane's height [px]
const GAP = 6;
const MARK = 5; // half the width of a mark

const style = () => getComputedStyle(document.documentElement);
const left = (width) => (width >= WIDE ? GUTTER : MARGIN);

/** Return the frame under a pointer; `labelled`: whether the canvas has room for labels on its left. */
export function frameAt(canvas, event, replay, labelled = false) {
  const box = canvas.getBoundingClientRect();
  const begin = labelled ? left(box.width) : MARGIN;
  const share = (event.clientX - box.left - begin) / Math.max(box.width - begin - MARGIN, 1);
  return Math.round(Math.min(Math.max(share, 0), 1) * (replay.frames - 1));
}

/** Height that the timeline needs [px]. */
export function timelineHeight(curves, more) {
  const tracks = tracksOf(curves).reduce((sum, track) => sum + track.height + GAP, 0);
  return 2 * TOP + Math.max(tracks + lanesOf(curves, more).length * LANE, 28);
}

function drawTrack(context, track, curves, top, x, colour) {
  const [low, high] = track.extent;
  const y = (value) => top + track.height - 2 - ((value - low) / (high - low)) * (track.height - 4);
  context.lineWidth = 1.25;
  context.lineJoin = "round";
  for (const { colour: name, values } of track.series) {
    context.strokeStyle = colour(name);
    context.beginPath();
    values.forEach((value, i) => context.lineTo(x(curves.frame[i]), y(value)));
    context.stroke();
  }
}

function drawLane(context, lane, top, x, colour) {
  const thick = lane.rows === 2 ? LANE / 2 - 2 : LANE - 4;
  for (const [first, last, , tone, row = 0] of lane.spans) {
    context.fillStyle = colour(tone ?? lane.colour);
    if (lane.marks) {
      context.beginPath();
      context.moveTo(x(first) - MARK, top);
      context.lineTo(x(first) + MARK, top);
      context.lineTo(x(first), top + LANE - 3);
      context.fill();
    } else {
      context.fillRect(x(first), top + 1 + (row * LANE) / 2, Math.max(x(last) - x(first), 1.5), thick);
    }
  }
}

/** Draw all that does not change from frame to frame. */
function drawStill(context, width, height, replay, curves, more) {
  const styles = style();
  const colour = (name) => (name.startsWith("--") ? styles.getPropertyValue(name).trim() : name);
  const begin = left(width);
  const x = (at) => begin + (at / Math.max(replay.frames - 1, 1)) * (width - begin - MARGIN);
  context.fillStyle = colour("--range");
  context.fillRect(x(replay.first), 0, Math.max(x(replay.last) - x(replay.first), 1), height);
  context.font = `11px ${styles.fontFamily}`;
  context.textBaseline = "middle";
  const label = (text, middle) => {
    if (begin !== GUTTER) return;
    context.fillStyle = colour("--muted");
    context.fillText(text, 8, middle, GUTTER - 16);
  };
  let top = TOP;
  for (const track of tracksOf(curves)) {
    label(track.label, top + track.height / 2);
    drawTrack(context, track, curves, top, x, colour);
    top += track.height + GAP;
  }
  for (const lane of lanesOf(curves, more)) {
    label(lane.label, top + LANE / 2);
    drawLane(context, lane, top, x, colour);
    top += LANE;
  }
}

const kept = { canvas: document.createElement("canvas"), key: "" };

/** Draw all of it for a frame. `more`: the cameras' `colours` and the `edits`. */
export function drawTimeline(canvas, replay, curves, more, frame) {
  const wanted = timelineHeight(curves, more);
  if (canvas.style.height !== `${wanted}px`) canvas.style.height = `${wanted}px`;
  const { context, width, height } = prepare(canvas);
  if (!width) return;
  const { take, solve, frames, first, last } = replay;
  const key = JSON.stringify([width, height, devicePixelRatio, take, solve, frames, first, last, more.serial, document.documentElement.dataset.theme]);
  if (kept.key !== key) {
    kept.key = key;
    Object.assign(kept.canvas, { width: canvas.width, height: canvas.height });
    const still = kept.canvas.getContext("2d");
    still.setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
    drawStill(still, width, height, replay, curves, more);
  }
  context.drawImage(kept.canvas, 0, 0, width, height);
  const begin = left(width);
  context.fillStyle = style().getPropertyValue("--text").trim();
  context.fillRect(begin + (frame / Math.max(frames - 1, 1)) * (width - begin - MARGIN) - 0.75, 0, 1.5, height);
}

/** Words for what is at a frame: values first, then what holds there. */
export function wordsAt(curves, more, frame) {
  if (!curves) return { values: t("curve.loading"), spans: [] };
  return { values: seriesNow(curves, frame), spans: spansNow(curves, more, frame) };
}
