// A rigid body in a list: its name, joint, use and shape, which can be set there; of the live stage, or of a take.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

const USES = ["", "prop", "evidence", "reference"];
const JOINTS = ["", "head", "left_hand", "right_hand", "left_wrist", "right_wrist", "left_elbow", "right_elbow", "chest", "hips", "left_knee", "right_knee", "left_ankle", "right_ankle"];
const HANDS = ["left_hand", "right_hand"];

/** A joint in words. */
export const jointWords = (joint) => joint.replace("_", " ");

/** Return a shape as it is typed. */
export const shapeWords = (shape) => (shape ? `${shape.kind}:${shape.size_cm.join(",")}${shape.axis === "z" ? "" : `,${shape.axis}`}` : "");

/** Which hand holds a prop in replays and exports. */
export const heldWords = ({ joint }) => (HANDS.includes(joint) ? t("rigid.held_by", { joint: jointWords(joint) }) : t("rigid.held"));

/** Return the row; `seen`, `below`: words next to its name and below it, `known`: its settings (null: none), `say(changes)` sets them. */
export function bodyRow(name, { seen, known, below, say }) {
  const choice = (key, values, value, words) => h("select", { aria: { label: t(`rigid.${key}`, { name }) }, onchange: (event) => say({ [key]: event.currentTarget.value }) },
    values.map((one) => h("option", { value: one, selected: one === value }, words(one))));
  return h("li", { class: "trigger" },
    h("div", { class: "set-row" }, h("span", { class: "name" }, name), h("span", { class: "count" }, seen)),
    h("div", { class: "set-row operate" },
      choice("joint", JOINTS, known?.joint ?? "", (one) => jointWords(one) || t("rigid.no_joint")),
      choice("use", known?.joint ? USES : USES.slice(0, 2), known?.use ?? "", (one) => t(`rigid.use.${one || "none"}`)),
      h("input", {
        type: "text", spellcheck: false, value: shapeWords(known?.shape), placeholder: "cylinder:3,60",
        aria: { label: t("rigid.shape", { name }) }, title: t("rigid.shape", { name }),
        onchange: (event) => say({ shape: event.currentTarget.value.trim() }),
      })),
    below && h("p", { class: "count" }, below));
}
