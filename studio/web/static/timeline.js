// Draws the timeline: the curve of a joint, spans of stance and of cameras that were left out, the range, the playhead.
import { prepare } from "./canvas.js";
import { number, t } from "./strings.js";

const AXES = { x: "--axis-x", y: "--axis-y", z: "--axis-z" };
const LANE = 7; // height of a span's lane [px]
const MARGIN = 6;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Return the frame under a pointer. */
export function frameAt(canvas, event, replay) {
  const box = canvas.getBoundingClientRect();
  const share = (event.clientX - box.left - MARGIN) / Math.max(box.width - 2 * MARGIN, 1);
  return Math.round(Math.min(Math.max(share, 0), 1) * (replay.frames - 1));
}

/** Lanes under the curve: label, colour and spans `[first, last]`. */
function lanesOf(curves) {
  if (!curves) return [];
  const stance = Object.entries(curves.stance).map(([side, spans]) => ({ label: t(`curve.stands.${side}`), colour: "--good", spans }));
  const cameras = Object.entries(curves.cameras).map(([name, spans]) => ({ label: t("curve.left_out", { name }), colour: "--bad", spans }));
  return [...stance, ...cameras];
}

function seriesOf(curves, kind) {
  if (!curves) return [];
  if (kind === "position_m") return Object.entries(curves.position_m).map(([axis, values]) => ({ label: axis, colour: AXES[axis], values }));
  return [{ label: "", colour: "--accent", values: curves[kind] }];
}

function extent(series) {
  const values = series.flatMap(({ values: all }) => all);
  const low = Math.min(...values), high = Math.max(...values);
  return high - low < 1e-6 ? [low - 0.5, high + 0.5] : [low, high];
}

const unit = { position_m: "m", speed_m_s: "m/s", confidence: "", uncertainty_mm: "mm" };

/** Words for the values at a frame. */
function words(series, kind, index) {
  return series.map(({ label, values }) => `${label} ${number(values[index], kind === "uncertainty_mm" ? 0 : 2)}`.trim())
    .join("  ").concat(" ", unit[kind]);
}

/** Words for the spans that hold a frame. */
function spansAt(lanes, frame) {
  return lanes.flatMap(({ label, spans }) => spans.filter(([first, last]) => first <= frame && frame <= last)
    .map(([, , reason]) => (reason ? `${label}: ${reason}` : label)));
}

/** Draw all of it for a frame; return the values there in words. */
export function drawTimeline(canvas, replay, curves, kind, frame) {
  const { context, width, height } = prepare(canvas);
  const x = (at) => MARGIN + (at / Math.max(replay.frames - 1, 1)) * (width - 2 * MARGIN);
  const lanes = lanesOf(curves);
  const bottom = height - lanes.length * LANE - 4;
  context.fillStyle = colour("--range");
  context.fillRect(x(replay.first), 0, Math.max(x(replay.last) - x(replay.first), 1), height);
  lanes.forEach((lane, row) => {
    context.fillStyle = colour(lane.colour);
    for (const [first, last] of lane.spans) {
      context.fillRect(x(first), bottom + 2 + row * LANE, Math.max(x(last) - x(first), 1.5), LANE - 2);
    }
  });
  const series = seriesOf(curves, kind);
  let text = "";
  if (series.length) {
    const [low, high] = extent(series);
    const y = (value) => bottom - 4 - ((value - low) / (high - low)) * (bottom - 10);
    context.lineWidth = 1.4;
    for (const { colour: name, values } of series) {
      context.strokeStyle = colour(name);
      context.beginPath();
      values.forEach((value, i) => context.lineTo(x(curves.frame[i]), y(value)));
      context.stroke();
    }
    const index = Math.round((frame / Math.max(replay.frames - 1, 1)) * (curves.frame.length - 1));
    text = [words(series, kind, index), ...spansAt(lanes, frame)].join("   ·   ");
  }
  context.fillStyle = colour("--text");
  context.fillRect(x(frame) - 0.75, 0, 1.5, height);
  return text;
}
