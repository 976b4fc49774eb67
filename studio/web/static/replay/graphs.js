// Graphs on the timeline: the chosen curves over one axis for each unit, with a grid; dotted where no camera saw the joint.
import { number, t } from "../base/strings.js";
import { channelWords, chosenCurves, styleOf } from "./curve_choice.js";
import { curveIn, curveValue } from "./curve_data.js";

const UNITS = { position: "m", rotation: "deg", speed: "m/s", distance: "mm" };
const SIGNS = { m: "m", deg: "°", "m/s": "m/s", mm: "mm" };
const DIGITS = { m: 3, deg: 1, "m/s": 2, mm: 0 };
const LEAST = { m: 0.02, deg: 2, "m/s": 0.1, mm: 4 }; // an axis spans so much at least
const FROM_ZERO = ["speed", "distance"];
const SHARE = 0.14, SHORTEST = 88, TALLEST = 220; // a single graph's height, of the window's
const LINE_PX = 17; // between lines of the grid at least
const GAP = 8;
const PAD = 0.06;
const DOTS = [1.5, 3.5];

/** Graphs from the top: what they show, their curves, and their height [px]. */
export function graphs() {
  const kinds = Object.keys(UNITS).map((kind) => ({ kind, unit: UNITS[kind], curves: chosenCurves().filter(({ channel }) => channel.split("_")[0] === kind) }))
    .filter(({ curves }) => curves.length);
  const one = Math.min(Math.max(SHARE * window.innerHeight, SHORTEST), TALLEST);
  const height = Math.round(Math.max((one * (1 + kinds.length)) / 2 / Math.max(kinds.length, 1), 58));
  return kinds.map((graph) => ({ ...graph, height }));
}

/** Height of all graphs [px]; 0 without chosen curves. */
export const graphsHeight = () => graphs().reduce((sum, { height }) => sum + height + GAP, 0);

/** Smallest step of 1, 2 or 5 times a power of ten that is not below `least`. */
function step(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((times) => times * power).find((one) => one >= least * (1 - 1e-9));
}

/** Return the lowest and highest value in a part, with a margin; a larger one below the unit's minimum span. */
function rangeOf({ kind, unit, curves }, part) {
  let low = Infinity, high = -Infinity;
  for (const curve of curves) {
    const data = curveIn(curve, part);
    if (!data) continue;
    for (let i = 0; i < data.frames.length; i += 1) {
      const value = data.values[i];
      if (value === null || data.frames[i] < part.from || data.frames[i] > part.to) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return [0, 1];
  if (FROM_ZERO.includes(kind)) low = 0;
  const more = Math.max(LEAST[unit] - (high - low), 0) / 2, room = (high - low) * PAD + more;
  return [FROM_ZERO.includes(kind) ? 0 : low - room, high + room];
}

/** The curve as two paths: where cameras saw the joint, and where none did. Nothing is drawn where no value is known. */
function paths(data, x, y) {
  const seen = new Path2D(), unseen = new Path2D(), { frames, values, unseen: spans } = data;
  let span = 0, before = null;
  for (let i = 0; i < frames.length; i += 1) {
    while (span < spans.length && spans[span][1] < frames[i]) span += 1;
    const path = span < spans.length && spans[span][0] <= frames[i] ? unseen : seen;
    if (values[i] === null) {
      before = null;
      continue;
    }
    const px = x(frames[i]), py = y(values[i]);
    if (before?.path !== path) path.moveTo(...(before ? [before.px, before.py] : [px, py]));
    path.lineTo(px, py);
    before = { path, px, py };
  }
  return { seen, unseen };
}

function drawCurve(context, curve, part, { x, y, colour }) {
  const data = curveIn(curve, part);
  if (!data) return;
  const { colour: name, dash } = styleOf(curve), { seen, unseen } = paths(data, x, y);
  context.strokeStyle = colour(name);
  context.lineWidth = 1.6;
  context.lineJoin = "round";
  context.setLineDash(dash);
  context.stroke(seen);
  context.setLineDash(DOTS);
  context.lineWidth = 1.1;
  context.stroke(unseen);
  context.setLineDash([]);
}

/** Draw all graphs below `top`; `within` clips to the area between the labels and the right end. Return where they end. */
export function drawGraphs(context, part, top, { x, begin, end, colour, within, wide }) {
  let y0 = top;
  for (const graph of graphs()) {
    const [low, high] = rangeOf(graph, part), { height, unit } = graph, from = y0;
    const y = (value) => from + height - ((value - low) / (high - low)) * height;
    const apart = step(((high - low) * LINE_PX) / height), digits = Math.max(0, -Math.floor(Math.log10(apart) + 1e-9));
    const labels = [];
    for (let k = Math.ceil(low / apart - 1e-9); k * apart <= high + 1e-9; k += 1) {
      context.fillStyle = colour("--line-strong");
      context.globalAlpha = k === 0 ? 0.9 : 0.3;
      context.fillRect(begin, y(k * apart) - 0.5, end - begin, 1);
      context.globalAlpha = 1;
      labels.push([number(k * apart || 0, digits), y(k * apart)]); // not -0
    }
    within(() => graph.curves.forEach((curve) => drawCurve(context, curve, part, { x, y, colour })));
    context.fillStyle = colour("--muted");
    context.textAlign = wide ? "right" : "left";
    for (const [words, at] of labels) if (at > from + 5 && at < from + height + 2) context.fillText(words, wide ? begin - 10 : begin + 2, at);
    context.textAlign = "left";
    context.save();
    context.font = `600 ${context.font}`;
    context.fillStyle = colour("--muted");
    if (wide) {
      context.translate(14, from + height / 2);
      context.rotate(-Math.PI / 2);
      context.textAlign = "center";
      context.fillText(`${t(`channel.${graph.kind}`)} ${SIGNS[unit]}`, 0, 0, height);
    } else {
      context.textAlign = "right";
      context.fillText(`${t(`channel.${graph.kind}`)} ${SIGNS[unit]}`, end - 2, from + 7);
    }
    context.restore();
    y0 += height + GAP;
  }
  return y0;
}

/** Return a curve's value at a frame in words, with its unit. */
export function valueWords(curve, frame) {
  const found = curveValue(curve, frame);
  if (!found) return "…";
  if (found.value === null) return t("graphs.unknown");
  const sign = SIGNS[found.unit];
  return `${found.near ? "≈ " : ""}${number(found.value || 0, DIGITS[found.unit])}${sign === "°" ? "" : " "}${sign}`;
}

/** The curves' values at a frame: `{colour, words}` each. */
export const valuesAt = (frame) => chosenCurves().map((curve) => ({ colour: styleOf(curve).colour, words: `${curve.joint} ${channelWords(curve.channel)}  ${valueWords(curve, frame)}` }));
