// What the timeline shows of a joint: tracks with curves, lanes with spans, and both in words at a frame.
import { hasText, number, t } from "../base/strings.js";
import { editLanes } from "../edits/bars.js";
import { performerWords } from "./performers.js";

/** Joints whose curves can be shown. */
export const JOINTS = [
  "Hips", "Spine2", "Head", "LeftArm", "LeftForeArm", "LeftHand", "RightArm", "RightForeArm", "RightHand",
  "LeftUpLeg", "LeftLeg", "LeftFoot", "LeftToeBase", "RightUpLeg", "RightLeg", "RightFoot", "RightToeBase",
];

const AXES = { x: "--axis-x", y: "--axis-y", z: "--axis-z" };
const HEIGHTS = { position_m: 44, speed_m_s: 26, confidence: 18 };
const UNITS = { position_m: "m", speed_m_s: "m/s", uncertainty_mm: "mm" };
const EVEN = 1e-6; // a curve that spans less is a line in the middle

/** A joint's path in the axes of exported files: y up, z forward. */
const inFileAxes = ({ x, y, z }) => ({ x, y: z, z: y.map((value) => -value) });

/** Return the lowest and highest value, never equal. */
function extent(series) {
  let low = Infinity, high = -Infinity;
  for (const { values } of series) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return high - low < EVEN ? [low - 0.5, high + 0.5] : [low, high];
}

/** Tracks from the top: label, height, extent, and a series of values per line. */
export function tracksOf(curves) {
  if (!curves) return [];
  const position = Object.entries(inFileAxes(curves.position_m)).map(([axis, values]) => ({ colour: AXES[axis], values }));
  const speed = [{ colour: "--accent", values: curves.speed_m_s }];
  const sure = [{ colour: "--good", values: curves.confidence }];
  const track = (key, series, range = extent(series)) => ({ label: t(`curve.${key}`), height: HEIGHTS[key], series, extent: range });
  return [track("position_m", position), track("speed_m_s", speed, [0, Math.max(extent(speed)[1], 0.1)]), track("confidence", sure, [0, 1])];
}

/** Lanes under the tracks: label, colour, spans `[first, last, words, colour, row]`; `marks`: short ones are drawn as marks. */
export function lanesOf(curves, { colours, edits }) {
  if (!curves) return [];
  const cameras = Object.keys(curves.used).map((name) => ({
    label: name, colour: colours[name] ?? "--muted",
    spans: [...curves.used[name].map(([first, last]) => [first, last, t("curve.used", { name })]),
      ...curves.cameras[name].map(([first, last, reason]) => [first, last, t("curve.left_out", { name, reason: reasonWords(reason) }), "--bad"])],
  }));
  const stands = (side, row) => curves.stance[side].map(([first, last]) => [first, last, t(`curve.stands.${side}`), null, row]);
  const feet = { label: t("curve.feet"), colour: "--muted", rows: 2, feet: true, spans: [...stands("left", 0), ...stands("right", 1)] };
  const pops = { label: t("curve.pops"), colour: "--fair", spans: curves.pops.map(([first, last]) => [first, last, t("curve.pop")]) };
  const off = Object.entries(curves.disagrees).flatMap(([name, spans]) => spans.map(([first, last, mm]) => [first, last, t("curve.disagrees", { name, mm })]));
  const apart = off.length ? [{ label: t("curve.apart"), colour: "--bad", spans: off }] : [];
  const mended = edits ? [{ label: t("edits.label"), colour: "--bad", marks: true, spans: edits }] : [];
  const doubts = Object.entries(curves.undecided).flatMap(([name, spans]) => spans.map(([first, last]) => [first, last, t("performers.undecided", { name: performerWords(name) })]));
  const undecided = doubts.length ? [{ label: t("performers.undecided_label"), colour: "--fair", spans: doubts }] : [];
  const gone = curves.away.map(([first, last]) => [first, last, t("performers.away")]);
  const away = gone.length ? [{ label: t("performers.away_label"), colour: "--muted", spans: gone }] : [];
  return [...cameras, feet, pops, ...away, ...undecided, ...apart, ...mended, ...editLanes()];
}

const reasonWords = (reason) => (hasText(`reason.${reason}`) ? t(`reason.${reason}`) : reason);

/** Return the index in `frames` of the one nearest to a frame. */
export function indexAt(frames, frame) {
  let low = 0, high = frames.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (frames[middle] < frame) low = middle + 1;
    else high = middle;
  }
  return low > 0 && frame - frames[low - 1] < frames[low] - frame ? low - 1 : low;
}

/** The curves' values at a frame, in words. */
export function seriesNow(curves, frame) {
  const at = indexAt(curves.frame, frame);
  const { x, y, z } = curves.position_m;
  const place = `X ${number(x[at], 2)}  Y ${number(z[at], 2)}  Z ${number(-y[at], 2)}`; // the axes of exported files
  const parts = [`${place} ${UNITS.position_m}`, `${number(curves.speed_m_s[at], 2)} ${UNITS.speed_m_s}`,
    t("curve.sure", { percent: number(100 * curves.confidence[at]) })];
  if (curves.uncertainty_mm[at] >= 0) parts.push(`±${number(curves.uncertainty_mm[at])} ${UNITS.uncertainty_mm}`);
  return parts.join("   ·   ");
}

/** Return what applies at a frame, in words; a mark also counts a little beyond it. */
export function spansNow(curves, more, frame) {
  const near = Math.max(curves.frame[curves.frame.length - 1] / 200, 1);
  return lanesOf(curves, more).flatMap(({ spans, marks }) => spans
    .filter(([first, last]) => (marks ? Math.abs(first - frame) <= near : first <= frame && frame <= last)).map(([, , words]) => words));
}

/** Return places to mend as spans of the timeline; `beginS`: stage time of the first frame [s]. */
export function editSpans(events, beginS, rate) {
  return events.map((event) => {
    const size = event.unit === "deg" ? `${number(event.size)}°` : `${number(event.size, 1)} ${event.unit}`;
    const frame = Math.round((event.peak_s - beginS) * rate);
    return [frame, frame, t("edits.event", { kind: t(`edits.${event.kind}`), joint: t(`joint.${event.joint}`), size })];
  });
}
