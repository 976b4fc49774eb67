// The skeleton over the picture.
const BONES = [
  [11, 12], [11, 13], [13, 15], [12, 14], [14, 16], [11, 23], [12, 24], [23, 24], [23, 25], [25, 27], [24, 26], [26, 28],
  [27, 29], [29, 31], [27, 31], [28, 30], [30, 32], [28, 32], [15, 19], [16, 20], [0, 11], [0, 12],
];
const JOINTS = [0, ...Array.from({ length: 22 }, (_, i) => i + 11)];
const LEFT = "#ffb454", RIGHT = "#5fd0ff", MIDDLE = "#ffffff";
const SEEN = 0.5;

const colourOf = (a, b) => (a % 2 !== b % 2 || a === 0 ? MIDDLE : a % 2 ? LEFT : RIGHT); // odd numbers are the left side

/** Draw a picture with the body found in it, so that they match however slow the phone is; poorly visible parts are faint. */
export function draw(canvas, { picture, landmarks, hands }) {
  const { width, height } = picture;
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const pen = canvas.getContext("2d");
  pen.drawImage(picture, 0, 0);
  if (!landmarks) return;
  const thick = Math.max(width, height) / 160;
  const at = (joint) => [landmarks[joint].x * width, landmarks[joint].y * height];
  pen.lineCap = "round";
  for (const [a, b] of BONES) {
    pen.globalAlpha = Math.min(landmarks[a].visibility, landmarks[b].visibility) > SEEN ? 0.95 : 0.25;
    for (const [style, extra] of [["rgba(0, 0, 0, .55)", thick], [colourOf(a, b), 0]]) {
      pen.strokeStyle = style;
      pen.lineWidth = thick + extra;
      pen.beginPath();
      pen.moveTo(...at(a));
      pen.lineTo(...at(b));
      pen.stroke();
    }
  }
  for (const joint of JOINTS) {
    pen.globalAlpha = landmarks[joint].visibility > SEEN ? 1 : 0.3;
    pen.fillStyle = MIDDLE;
    pen.beginPath();
    pen.arc(...at(joint), 0.9 * thick, 0, 2 * Math.PI);
    pen.fill();
  }
  pen.globalAlpha = 1;
  for (const [colour, hand] of [[LEFT, hands.left], [RIGHT, hands.right]]) {
    pen.fillStyle = colour;
    for (const { x, y } of hand ?? []) pen.fillRect(x * width - thick / 3, y * height - thick / 3, thick / 1.5, thick / 1.5);
  }
}
