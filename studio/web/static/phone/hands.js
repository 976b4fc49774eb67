// The landmarks of the hands, in pictures cut out at the ends of the arms. Runs in the thread of `pose_worker.js`.
import { HandLandmarker } from "../vendor/tasks_vision/vision_bundle.mjs";

const ARMS = { left: [13, 15, 17, 19], right: [14, 16, 18, 20] }; // elbow, wrist, and the knuckles of little and index finger
const LEAST = 60; // pixels of a hand: a smaller one is not worth a look
const OF_FOREARM = 0.75, OF_KNUCKLES = 2; // length of a hand, by that of the forearm and by wrist to knuckles
const WIDTH = 2.2; // side of the cut, in lengths of the hand
const CUT = 224;

/** Return the square around a hand, {x, y, side} in pixels; null if it is too small or not seen. */
export function squareOf(landmarks, [elbow, wrist, little, index], width, height) {
  const at = (joint) => [landmarks[joint].x * width, landmarks[joint].y * height];
  const [e, w, l, i] = [elbow, wrist, little, index].map(at);
  const knuckles = [(l[0] + i[0]) / 2, (l[1] + i[1]) / 2];
  const size = Math.max(OF_FOREARM * Math.hypot(w[0] - e[0], w[1] - e[1]), OF_KNUCKLES * Math.hypot(knuckles[0] - w[0], knuckles[1] - w[1]));
  const inside = knuckles[0] > 0 && knuckles[1] > 0 && knuckles[0] < width && knuckles[1] < height;
  if (size < LEAST || landmarks[wrist].visibility < 0.5 || !inside) return null;
  const side = WIDTH * size;
  return { x: knuckles[0] - side / 2, y: knuckles[1] - side / 2, side };
}

export class Hands {
  /** Load the model; `files` are the library's. */
  static async load(files, modelAssetPath, delegate) {
    const hands = new Hands();
    hands.landmarker = await HandLandmarker.createFromOptions(files, { baseOptions: { modelAssetPath, delegate }, runningMode: "IMAGE", numHands: 1 });
    hands.canvas = new OffscreenCanvas(CUT, CUT);
    hands.pen = hands.canvas.getContext("2d");
    return hands;
  }

  /** Return {left, right}: 21 landmarks each in shares of the picture, or null. */
  find(picture, landmarks) {
    const { width, height } = picture;
    return Object.fromEntries(Object.entries(ARMS).map(([side, arm]) => [side, this.#hand(picture, squareOf(landmarks, arm, width, height))]));
  }

  #hand(picture, square) {
    if (!square) return null;
    const { x, y, side } = square;
    this.pen.fillRect(0, 0, CUT, CUT);
    this.pen.drawImage(picture, x, y, side, side, 0, 0, CUT, CUT);
    const [found] = this.landmarker.detect(this.canvas).landmarks;
    return found ? found.map((one) => ({ x: (x + one.x * side) / picture.width, y: (y + one.y * side) / picture.height })) : null;
  }

  close() { this.landmarker.close(); }
}
