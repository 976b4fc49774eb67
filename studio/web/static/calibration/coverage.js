// The coverage map: where the hips were while a calibration gathers frames, seen from above, the camera at the bottom.
import { svg } from "../base/dom.js";

const FULL = 45; // frames in a cell that count as full
const WIDE = 4; // cells to either side of the camera that are always shown
const FAR = 9; // and away from it
const ENOUGH_POINTS = 600, ENOUGH_CELLS = 8; // as the server asks for

/** Return how much of what a calibration needs from a camera is there, 0 to 1. */
export function coverageShare({ points, cells }) {
  return Math.min(1, points / ENOUGH_POINTS, cells.length / ENOUGH_CELLS);
}

/** Return the map of one camera as a picture: walked cells in the camera's colour on a floor of half metres. */
export function coverageMap({ cells }, colour, label) {
  const xs = cells.map(([x]) => x), zs = cells.map(([, z]) => z);
  const left = Math.min(-WIDE, ...xs), right = Math.max(WIDE - 1, ...xs);
  const far = Math.max(FAR, ...zs), near = Math.min(0, ...zs);
  const [width, height] = [right - left + 1, far - near + 1];
  const walked = new Map(cells.map(([x, z, count]) => [`${x},${z}`, count]));
  const squares = [];
  for (let z = near; z <= far; z += 1) {
    for (let x = left; x <= right; x += 1) {
      const count = walked.get(`${x},${z}`);
      squares.push(svg("rect", {
        x: x - left + 0.06, y: far - z + 0.06, width: 0.88, height: 0.88, rx: 0.14,
        ...(count ? { fill: colour, "fill-opacity": Math.min(1, 0.35 + (0.65 * count) / FULL) } : { class: "floor" }),
      }));
    }
  }
  const eye = -left, foot = height;
  const camera = svg("path", { d: `M${eye} ${foot - 0.1}l-0.5 0.8h1z`, fill: colour });
  return svg("svg", { viewBox: `0 0 ${width} ${height + 0.8}`, role: "img", "aria-label": label, class: "coverage-map" }, ...squares, camera);
}
