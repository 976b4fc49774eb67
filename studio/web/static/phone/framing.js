// Advice on placing the camera: what to change first, judging by what it sees and how it is held.
const SEEN = 0.5, EDGE = 0.01;
const DARK = 45, BRIGHT = 225; // mean brightness of a picture, 0 to 255
const NEAR = 0.95, FAR = 0.4, ASIDE = 0.3; // height of a body in the picture, and how far off the middle it may be
const SLANTED_DEG = 10;
const HEAD = [0, 7, 8], FEET = [27, 28, 29, 30, 31, 32], TRUNK = [11, 12, 23, 24];

const inside = ({ x, y, visibility }) => visibility > SEEN && x > EDGE && x < 1 - EDGE && y > EDGE && y < 1 - EDGE;

/** Whether a picture of this brightness is too dark. */
export const isDark = (brightness) => brightness !== null && brightness < DARK;

/** Return {key, values, tone} of the first thing to change, or that all is good.
 *
 * `found`: what was found in the last picture, null before the first; `brightness`: of the picture; `held`: {slanted_deg,
 * flat, moving} or null where the phone does not report it; `wide`: a wide lens. */
export function advice({ found, brightness, held, wide }) {
  const say = (key, tone = "fair", values = {}) => ({ key: `phone_camera.advice.${key}`, tone, values });
  if (!found) return say("starting", "plain");
  if (isDark(brightness)) return say("dark", "bad");
  if (!found.landmarks) return say("nobody", "bad");
  if (found.people > 1) return say("two", "fair");
  const { landmarks } = found;
  const outOf = (joints) => joints.filter((joint) => !inside(landmarks[joint])).length > joints.length / 2;
  if (outOf(HEAD) && outOf(FEET)) return say("whole", "bad");
  if (outOf(HEAD)) return say("head", "bad");
  if (outOf(FEET)) return say("feet", "bad");
  const ys = landmarks.map(({ y }) => y), size = Math.max(...ys) - Math.min(...ys);
  if (size > NEAR) return say("back");
  if (size < FAR) return say("closer", "fair", { percent: Math.round(100 * size) });
  const middle = TRUNK.reduce((sum, joint) => sum + landmarks[joint].x, 0) / TRUNK.length;
  if (Math.abs(middle - 0.5) > ASIDE) return say(middle < 0.5 ? "left" : "right");
  if (held?.flat) return say("flat");
  if (held?.moving) return say("stand");
  if (held && held.slanted_deg > SLANTED_DEG) return say("slanted", "fair", { degrees: Math.round(held.slanted_deg) });
  if (wide) return say("wide");
  if (brightness > BRIGHT) return say("bright");
  return say("good", "good");
}

/** Return the mean brightness of a picture, 0 to 255. */
export function brightnessOf(video, canvas) {
  const pen = canvas.getContext("2d", { willReadFrequently: true });
  pen.drawImage(video, 0, 0, canvas.width, canvas.height);
  const { data } = pen.getImageData(0, 0, canvas.width, canvas.height);
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum += 0.299 * data[i] + 0.587 * data[i + 1] + 0.114 * data[i + 2];
  return sum / (data.length / 4);
}
