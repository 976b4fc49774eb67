// The curve of the compare view: distance between two motions over time, with the playhead.
import { clock } from "../base/dom.js";
import { number, t } from "../base/strings.js";
import { prepare } from "../base/canvas.js";

const MARGIN = 6;
const TOP_PX = 14, BOTTOM_PX = 16;

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** Return the index in `frames` of the sample nearest to a frame. */
export function nearest(frames, frame) {
  let low = 0, high = frames.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (frames[middle] <= frame) low = middle;
    else high = middle;
  }
  return Math.abs(frames[low] - frame) <= Math.abs(frames[high] - frame) ? low : high;
}

function line(context, frames, values, x, y) {
  context.beginPath();
  let pen = false;
  values.forEach((value, i) => {
    if (value === null) { pen = false; return; }
    if (pen) context.lineTo(x(frames[i]), y(value));
    else context.moveTo(x(frames[i]), y(value));
    pen = true;
  });
  context.stroke();
}

/** Draw the mean over joints, and one joint's distance if `joint` is given, for a replay at a frame. */
export function drawDifference(canvas, found, joint, replay, frame) {
  const { context, width, height } = prepare(canvas);
  const own = joint ? found.joints_mm[joint] : null;
  const shown = [...found.mean_over_joints_mm, ...(own ?? [])].filter((value) => value !== null);
  const high = Math.max(...shown, 1);
  const x = (at) => MARGIN + (at / Math.max(replay.frames - 1, 1)) * (width - 2 * MARGIN);
  const y = (value) => height - BOTTOM_PX - (value / high) * (height - TOP_PX - BOTTOM_PX);
  context.fillStyle = colour("--range");
  context.fillRect(x(replay.first), 0, Math.max(x(replay.last) - x(replay.first), 1), height);
  context.strokeStyle = colour("--line");
  context.beginPath();
  context.moveTo(MARGIN, y(high));
  context.lineTo(width - MARGIN, y(high));
  context.stroke();
  context.lineWidth = 1.2;
  context.strokeStyle = own ? colour("--muted") : colour("--accent");
  line(context, found.frame, found.mean_over_joints_mm, x, y);
  if (own) {
    context.lineWidth = 1.5;
    context.strokeStyle = colour("--accent");
    line(context, found.frame, own, x, y);
  }
  context.fillStyle = colour("--muted");
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "top";
  context.fillText(`${number(high)} mm`, MARGIN, 1);
  const below = height - BOTTOM_PX + 3;
  context.fillText(clock(0), MARGIN, below);
  context.textAlign = "center";
  context.fillText(t("compare.axis"), width / 2, below);
  context.textAlign = "right";
  context.fillText(clock((replay.frames - 1) / replay.rate_hz), width - MARGIN, below);
  context.textAlign = "left";
  context.fillStyle = colour("--text");
  context.fillRect(x(frame) - 0.75, 0, 1.5, height);
}
