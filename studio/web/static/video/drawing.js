// A picture of a video, and what is drawn over it.
import { prepare } from "../base/canvas.js";

const FINE = 10000; // places in a picture come as ten thousandths of its width and height
const LARGE = 500; // a smaller picture gets thinner lines [CSS pixels]
const EDGE = "rgba(0, 0, 0, .55)";
const STYLES = { landmarks: { line: "#ffb454", dot: "#ffb454", width: 1.4, radius: 2.4 }, skeleton: { line: "#4fe3c1", dot: "#ffffff", width: 2.4, radius: 2.2 } };

/** Colour of what is drawn over pictures, by kind. */
export const colourOf = (kind) => STYLES[kind].line;

function drawFigure(pen, kind, { joints, bones }, place) {
  const { line, dot, ...sizes } = STYLES[kind], by = Math.min(Math.max(place.height, place.width) / LARGE, 1);
  const [width, radius] = [sizes.width * by, sizes.radius * by];
  const at = (joint) => pointOf(joints, joint, place);
  pen.lineCap = "round";
  for (const [style, thick] of [[EDGE, width + 2 * by], [line, width]]) {
    pen.strokeStyle = style;
    pen.lineWidth = thick;
    pen.beginPath();
    for (const [a, b] of bones) {
      const [from, to] = [at(a), at(b)];
      if (!from || !to) continue;
      pen.moveTo(...from);
      pen.lineTo(...to);
    }
    pen.stroke();
  }
  pen.fillStyle = dot;
  for (let joint = 0; joint < joints.length / 2; joint += 1) {
    const point = at(joint);
    if (!point) continue;
    pen.beginPath();
    pen.arc(...point, radius, 0, 2 * Math.PI);
    pen.fill();
  }
}

/** Return a joint's place [CSS pixels], from the places `joints` in a picture drawn at `place`; null if it is not drawn. */
export const pointOf = (joints, joint, place) => (joints[2 * joint] === null || joints[2 * joint] === undefined ? null
  : [place.left + (joints[2 * joint] / FINE) * place.width, place.top + (joints[2 * joint + 1] / FINE) * place.height]);

/** Draw a joint that is dragged from its place [CSS pixels] to another. */
export function drawDragged(canvas, from, to) {
  const pen = canvas.getContext("2d");
  for (const [style, width] of [[EDGE, 4], [STYLES.skeleton.line, 2]]) {
    pen.strokeStyle = style;
    pen.lineWidth = width;
    pen.beginPath();
    pen.moveTo(...from);
    pen.lineTo(...to);
    pen.moveTo(to[0] + 7, to[1]);
    pen.arc(...to, 7, 0, 2 * Math.PI);
    pen.stroke();
  }
}

/** Draw a picture as large as the canvas allows, with figures `{kind: {joints, bones}}` over it; return its place [CSS pixels]. */
export function drawPicture(canvas, picture, figures) {
  const { context: pen, width, height } = prepare(canvas);
  if (!picture) return null;
  const by = Math.min(width / picture.width, height / picture.height);
  const place = { width: picture.width * by, height: picture.height * by };
  Object.assign(place, { left: (width - place.width) / 2, top: (height - place.height) / 2 });
  pen.drawImage(picture, place.left, place.top, place.width, place.height);
  pen.save();
  pen.beginPath();
  pen.rect(place.left, place.top, place.width, place.height);
  pen.clip();
  for (const [kind, figure] of Object.entries(figures)) drawFigure(pen, kind, figure, place);
  pen.restore();
  return place;
}
