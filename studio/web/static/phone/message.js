// What was found in a picture as the message `landmarks` of the protocol (docs/protocol.md).
const JOINTS = 33;
const NONE = new Uint8Array(0);

/** The other side's landmark, by number: 0 is the nose, from 1 on left and right alternate, eyes and mouth too. */
const OTHER = [0, 4, 5, 6, 1, 2, 3, ...Array.from({ length: JOINTS - 7 }, (_, i) => (i % 2 ? i + 6 : i + 8))];

const bytes = (values) => new Uint8Array(Float32Array.from(values).buffer);

/** Return what was found in a mirrored picture as if it had not been mirrored. */
export function unmirrored(found) {
  if (!found.landmarks) return found;
  const turned = (points, far) => OTHER.map((other) => ({ ...points[other], x: far - points[other].x }));
  return { ...found, landmarks: turned(found.landmarks, 1), world: turned(found.world, 0) };
}

/** Return the message of one frame; `time_ns` on the phone's clock. Nobody in the picture: all landmarks are unseen. */
export function landmarkMessage(sequence, time_ns, { landmarks, world, width, height }) {
  const none = new Array(JOINTS).fill(null);
  return {
    type: "landmarks", sequence, device_time_ns: time_ns, width, height,
    pixels: bytes((landmarks ?? none).flatMap((one) => (one ? [one.x * width - 0.5, one.y * height - 0.5] : [NaN, NaN]))),
    visibility: bytes((landmarks ?? none).map((one) => Math.min(1, Math.max(0, one?.visibility ?? 0)))),
    world: world ? bytes(world.flatMap(({ x, y, z }) => [x, y, z])) : NONE,
    left_hand: NONE, right_hand: NONE, head_wxyz: null,
  };
}
