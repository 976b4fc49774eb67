// Camera looks, `{position, target}` in the stage frame [m], that contain what is to be seen; z is up.

const HALF = Math.tan((37 * Math.PI) / 180 / 2); // of the picture's height, at a distance of 1: as scene.py sets the angle
const MARGIN = 1.08;
const SAME_ASPECT = 1.02; // pictures are of whole pixels
const FROM = [0.34, -1.0, 0.3];
const MOTION_FROM = [0.3, -1.0, 0.16];

const box = (low, high) => [0, 1, 2, 3, 4, 5, 6, 7].map((i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? high : low)[axis]));
const PERFORMER = box([-0.9, -0.5, 0], [0.9, 0.5, 1.95]); // a performer with open arms
const CAMERA = box([-0.2, -0.2, -0.2], [0.2, 0.2, 0.3]); // a camera's frustum with its name

export const add = (a, b) => a.map((x, i) => x + b[i]);
export const sub = (a, b) => a.map((x, i) => x - b[i]);
export const length = (a) => Math.hypot(...a);
const scaled = (a, by) => a.map((x) => x * by);
const dot = (a, b) => a.reduce((sum, x, i) => sum + x * b[i], 0);
const cross = ([a, b, c], [d, e, f]) => [b * f - c * e, c * d - a * f, a * e - b * d];

/** Return right, up and forward of a camera that looks back along `direction`. */
function axesTowards(direction) {
  const forward = scaled(direction, -1 / length(direction));
  const across = cross(forward, [0, 0, 1]);
  const right = scaled(across, 1 / Math.max(length(across), 1e-9));
  return [right, cross(right, forward), forward];
}

/** Project a point of the stage into a picture of a height [px]: `{x, y}` from its middle, y down, and `metre`, the pixels per
 * metre there; null behind the camera. */
export function project(point, { position, target }, height) {
  const [x, y, depth] = axesTowards(sub(position, target)).map((axis) => dot(sub(point, position), axis));
  const metre = height / (2 * HALF * depth);
  return depth > 0 ? { x: x * metre, y: -y * metre, metre } : null;
}

/** Return the nearest look from a direction, not straight from above, whose picture of this `aspect` contains all points. */
export function fit(points, direction, aspect, margin = MARGIN) {
  const axes = axesTowards(direction);
  const places = points.map((point) => axes.map((axis) => dot(point, axis)));
  // A point at depth z is inside where |place - centre| <= slope * (z - eye): each side bounds the eye's depth.
  const sides = [HALF * aspect, HALF].map((half, i) => {
    const slope = half / margin;
    const low = Math.min(...places.map((p) => p[i] + slope * p[2])), high = Math.max(...places.map((p) => p[i] - slope * p[2]));
    return { centre: (low + high) / 2, depth: (low - high) / (2 * slope) };
  });
  const depths = places.map((p) => p[2]);
  const eye = Math.min(sides[0].depth, sides[1].depth, Math.min(...depths) - 0.2);
  const middle = depths.reduce((sum, z) => sum + z, 0) / depths.length;
  const at = (depth) => [0, 1, 2].map((i) => axes[0][i] * sides[0].centre + axes[1][i] * sides[1].centre + axes[2][i] * depth);
  return { position: at(eye), target: at(middle) };
}

const bodies = (performers) => performers.flatMap(([x, y]) => PERFORMER.map((corner) => add(corner, [x, y, 0])));

/** Return the middle of performers' places on the floor, `[x, y]` each; without performers that of the stage. */
export function middle(performers) {
  if (!performers.length) return [0, 0];
  return [0, 1].map((axis) => (Math.min(...performers.map((at) => at[axis])) + Math.max(...performers.map((at) => at[axis]))) / 2);
}

/** A look at all cameras, and at the performers at places on the floor, `[x, y]` each. */
export function wholeStage(cameras, performers, aspect) {
  return fit([...bodies(performers.length ? performers : [[0, 0]]), ...cameras.flatMap((camera) => CAMERA.map((corner) => add(corner, camera)))], FROM, aspect);
}

/** A look at a motion from its first to its last frame, by its outermost points. */
export const wholeMotion = (points, aspect) => fit(points.length ? points : PERFORMER, MOTION_FROM, aspect);

/** A look at performers with open arms, from a direction. */
export function wholePerformers(performers, direction, aspect) {
  const steep = Math.hypot(direction[0], direction[1]) < 0.2 * length(direction) || length(direction) < 1e-6; // from above nothing is tall
  return fit(bodies(performers), steep ? MOTION_FROM : direction, aspect);
}

/** Return another browser's look, from further away if this one's picture is narrower, so that it contains the other's. */
export function widened({ position, target, aspect }, own) {
  const by = aspect / own > SAME_ASPECT ? aspect / own : 1;
  return { position: add(target, scaled(sub(position, target), by)), target };
}

/** A look turned about the vertical through its target. */
export function turned({ position, target }, angle) {
  const [x, y, z] = sub(position, target), [c, s] = [Math.cos(angle), Math.sin(angle)];
  return { position: add(target, [c * x - s * y, s * x + c * y, z]), target };
}
