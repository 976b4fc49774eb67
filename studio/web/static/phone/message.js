// The protocol's message for what was found in a picture (docs/protocol.md): a skeleton with landmarks.
const JOINTS = 33;
const NONE = new Uint8Array(0);

/** Landmark of the other side, by number: 0 is the nose, 1 to 3 and 4 to 6 the eyes; from 7 on left and right alternate. */
const OTHER = [0, 4, 5, 6, 1, 2, 3, ...Array.from({ length: JOINTS - 7 }, (_, i) => (i % 2 ? i + 6 : i + 8))];

const bytes = (values) => new Uint8Array(Float32Array.from(values).buffer);

/** Return what was found in a mirrored picture as if it had not been mirrored. */
export function unmirrored(found) {
  if (!found.landmarks) return found;
  const turned = (points, far) => OTHER.map((other) => ({ ...points[other], x: far - points[other].x }));
  const hand = (points) => points?.map((one) => ({ ...one, x: 1 - one.x })) ?? null;
  const hands = { left: hand(found.hands.right), right: hand(found.hands.left) };
  return { ...found, landmarks: turned(found.landmarks, 1), world: turned(found.world, 0), hands };
}

/** Return the message of one frame; `time_ns` on the phone's clock. With nobody in the picture all landmarks are unseen. */
export function landmarkMessage(sequence, time_ns, { landmarks, world, hands, width, height }) {
  const pixels = (points) => bytes(points.flatMap(({ x, y }) => [x * width - 0.5, y * height - 0.5])); // the first pixel's centre is (0, 0)
  const points = landmarks ?? new Array(JOINTS).fill({ x: NaN, y: NaN, visibility: 0 });
  return {
    type: "skeleton", sequence, device_time_ns: time_ns, positions: NONE,
    confidence: bytes(points.map(({ visibility }) => Math.min(1, Math.max(0, visibility ?? 0)))),
    landmarks: {
      width, height,
      pixels: pixels(points),
      world: world ? bytes(world.flatMap(({ x, y, z }) => [x, y, z])) : NONE,
      left_hand: hands.left ? pixels(hands.left) : NONE,
      right_hand: hands.right ? pixels(hands.right) : NONE,
    },
  };
}
