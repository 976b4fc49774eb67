// Draws the timeline: ruler, markers, a joint's curves or the graphs of several, which cameras were used, standing feet, pops, edits, the range, the playhead.
import { prepare } from "../base/canvas.js";
import { barsKey } from "../edits/bars.js";
import { lanesOf, seriesNow, spansNow, tracksOf } from "./curves.js";
import { curveDataKey } from "./curve_data.js";
import { drawGraphs, graphs, graphsHeight } from "./graphs.js";
import { markedFrames, timecodeOf } from "./markers.js";
import { bridgedFrames, frameWords, ticks, unit } from "./ruler.js";
import { t } from "../base/strings.js";
import { shownPart } from "./zoom.js";

const MARGIN = 6;
const GUTTER = 96; // room for labels, where there is some
const WIDE = 700;
const RULER = 20; // the ruler's height [px]
const TOP = RULER + 4;
const LANE = 12; // a lane's height [px]
const GAP = 6;
const MARK = 5; // half the width of a mark

const style = () => getComputedStyle(document.documentElement);
const left = (width) => (width >= WIDE ? GUTTER : MARGIN);

/** Return the frame under a pointer; `labelled`: whether the canvas has room for labels on its left. */
export function frameAt(canvas, event, replay, labelled = false) {
  const box = canvas.getBoundingClientRect();
  const begin = labelled ? left(box.width) : MARGIN;
  const share = Math.min(Math.max((event.clientX - box.left - begin) / Math.max(box.width - begin - MARGIN, 1), 0), 1);
  if (!labelled) return Math.round(share * (replay.frames - 1));
  const { from, to } = shownPart(replay);
  return Math.round(from + share * (to - from));
}

/** Return the pixels per frame. */
export function pixelsPerFrame(canvas, replay) {
  const { from, to } = shownPart(replay);
  return (canvas.clientWidth - left(canvas.clientWidth) - MARGIN) / (to - from);
}

/** Whether a pointer is on the ruler. */
export const onRuler = (canvas, event) => event.clientY - canvas.getBoundingClientRect().top < RULER;

const tracksHeight = (curves) => graphsHeight() || tracksOf(curves).reduce((sum, track) => sum + track.height + GAP, 0);

/** Height that the timeline needs [px]. */
export const timelineHeight = (curves, more) => TOP + 4 + Math.max(tracksHeight(curves) + lanesOf(curves, more).length * LANE, 28);

/** The lane under a pointer, and its row; the lane is undefined where there is none. */
export function laneAt(canvas, event, curves, more) {
  const at = (event.clientY - canvas.getBoundingClientRect().top - TOP - tracksHeight(curves)) / LANE;
  return { lane: at < 0 ? undefined : lanesOf(curves, more)[Math.floor(at)], row: at % 1 < 0.5 ? 0 : 1 };
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
    if (lane.marks && last - first < 1) {
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

/** Draw clipped to the area between the labels and the right end. */
function within(context, begin, width, height, draw) {
  context.save();
  context.beginPath();
  context.rect(begin - MARGIN, 0, width - begin + MARGIN, height);
  context.clip();
  draw();
  context.restore();
}

/** Draw the ruler, the played range with its ends, and the markers. */
function drawRuler(context, height, replay, { x, begin, end, colour }) {
  const [first, last] = [Math.max(x(replay.first), begin - MARGIN), Math.min(x(replay.last), end + MARGIN)];
  context.fillStyle = colour("--range");
  if (last >= first) context.fillRect(first, 0, Math.max(last - first, 1), height);
  context.fillStyle = colour("--line");
  context.fillRect(begin, RULER - 1, end - begin, 1);
  for (const frame of ticks(shownPart(replay), replay.rate_hz, (end - begin) / (shownPart(replay).to - shownPart(replay).from))) {
    context.fillStyle = colour("--line");
    context.fillRect(x(frame), RULER - 5, 1, height - RULER + 5);
    context.fillStyle = colour("--muted");
    const words = frameWords(Math.round(frame), replay, timecodeOf(replay.take));
    if (x(frame) + 4 + context.measureText(words).width < end) context.fillText(words, x(frame) + 4, RULER / 2 - 1);
  }
  context.fillStyle = colour("--accent");
  for (const edge of [first, last]) if (edge >= begin - MARGIN && edge <= end + MARGIN) context.fillRect(edge - 1, 0, 2, RULER);
  within(context, begin, end + MARGIN, height, () => {
    context.fillStyle = colour("--fair");
    if (unit() === "timecode") for (const [from, to] of bridgedFrames(replay, timecodeOf(replay.take))) context.fillRect(x(from), RULER - 3, Math.max(x(to) - x(from), 1), 3);
    for (const { frame, name } of markedFrames(replay)) {
      context.fillStyle = colour("--fair");
      context.fillRect(x(frame) - 0.5, RULER, 1, height);
      context.beginPath();
      context.moveTo(x(frame) - MARK, RULER - 9);
      context.lineTo(x(frame) + MARK, RULER - 9);
      context.lineTo(x(frame), RULER);
      context.fill();
      context.fillText(name, x(frame) + MARK + 2, RULER + 8, 120);
    }
  });
}

/** Draw all that does not change from frame to frame. */
function drawStill(context, width, height, replay, curves, more) {
  const styles = style();
  const colour = (name) => (name.startsWith("--") ? styles.getPropertyValue(name).trim() : name);
  const begin = left(width);
  const { from, to } = shownPart(replay);
  const x = (at) => begin + ((at - from) / (to - from)) * (width - begin - MARGIN);
  context.font = `11px ${styles.fontFamily}`;
  context.textBaseline = "middle";
  drawRuler(context, height, replay, { x, begin, end: width - MARGIN, colour });
  const label = (text, middle) => {
    if (begin !== GUTTER) return;
    context.fillStyle = colour("--muted");
    context.fillText(text, 8, middle, GUTTER - 16);
  };
  let top = TOP;
  const drawn = { x, begin, end: width - MARGIN, colour, wide: begin === GUTTER, within: (draw) => within(context, begin, width, height, draw) };
  if (graphsHeight()) top = drawGraphs(context, { from, to }, top, drawn);
  for (const track of graphsHeight() ? [] : tracksOf(curves)) {
    label(track.label, top + track.height / 2);
    within(context, begin, width, height, () => drawTrack(context, track, curves, top, x, colour));
    top += track.height + GAP;
  }
  for (const lane of lanesOf(curves, more)) {
    label(lane.label, top + LANE / 2);
    within(context, begin, width, height, () => drawLane(context, lane, top, x, colour));
    top += LANE;
  }
}

const kept = { canvas: document.createElement("canvas"), key: "", on: null, frame: -1 }; // `on` and `frame`: what it was drawn on last

/** Draw all of it for a frame. `more`: the cameras' `colours` and the `edits`. */
export function drawTimeline(canvas, replay, curves, more, frame) {
  const wanted = timelineHeight(curves, more);
  if (canvas.style.height !== `${wanted}px`) canvas.style.height = `${wanted}px`;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (!width) return;
  const { take, solve, performer, frames, first, last } = replay;
  const key = JSON.stringify([width, height, devicePixelRatio, take, solve, performer, frames, first, last, more.serial, document.documentElement.dataset.theme, document.documentElement.lang,
    shownPart(replay), unit(), markedFrames(replay), timecodeOf(take), graphs(), curveDataKey(), barsKey()]);
  if (kept.key === key && kept.on === canvas && kept.frame === frame) return; // it would be composed again by the browser
  const { context } = prepare(canvas);
  Object.assign(kept, { on: canvas, frame });
  if (kept.key !== key) {
    kept.key = key;
    Object.assign(kept.canvas, { width: canvas.width, height: canvas.height });
    const still = kept.canvas.getContext("2d");
    still.setTransform(canvas.width / width, 0, 0, canvas.height / height, 0, 0);
    drawStill(still, width, height, replay, curves, more);
  }
  context.drawImage(kept.canvas, 0, 0, width, height);
  const begin = left(width), { from, to } = shownPart(replay);
  if (frame < from || frame > to) return;
  context.fillStyle = style().getPropertyValue("--text").trim();
  context.fillRect(begin + ((frame - from) / (to - from)) * (width - begin - MARGIN) - 0.75, 0, 1.5, height);
}

/** Return what is at a frame in words: the values, and what applies there. */
export function wordsAt(curves, more, frame) {
  if (!curves) return { values: t("curve.loading"), spans: [] };
  return { values: seriesNow(curves, frame), spans: spansNow(curves, more, frame) };
}
