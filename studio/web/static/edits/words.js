// Descriptions of edits in words, and the names of their joints.
import { clock } from "../base/dom.js";
import { number, t } from "../base/strings.js";
import { performerWords } from "../replay/performers.js";
import { secondsOf } from "./time.js";

const PARTS = { Arm: "shoulder", ForeArm: "elbow", Hand: "wrist", HandMiddle1: "hand", UpLeg: "hip", Leg: "knee", Foot: "ankle", ToeBase: "toe" };
const SIDES = { Left: "left", Right: "right" };

/** Output joint by canonical joint. */
export const OUTPUT = {
  hips: "Hips", spine: "Spine1", chest: "Spine2", neck: "Neck", head: "Head",
  ...Object.fromEntries(Object.entries(SIDES).flatMap(([Side, side]) => Object.entries(PARTS).map(([part, name]) => [`${side}_${name}`, `${Side}${part}`]))),
};
/** Canonical joint by output joint. */
export const CANONICAL = Object.fromEntries(Object.entries(OUTPUT).map(([canonical, output]) => [output, canonical]));

/** Joints that can have a contact. */
export const TOUCHING = Object.keys(OUTPUT).filter((name) => /_(hand|ankle|toe|knee|hip)$/.test(name));

/** Return the canonical joint that an output joint is, or belongs to. */
export function canonicalOf(joint) {
  const side = /^(Left|Right)/.exec(joint)?.[1];
  return CANONICAL[joint] ?? (side ? `${SIDES[side]}_${joint.includes("Hand") ? "hand" : "shoulder"}` : "spine");
}

const jointWords = (joint) => t(`joint.${joint}`);

/** Return several joints in words; all joints if none is named. */
const several = (joints) => (joints?.length ? joints.map(jointWords).join(", ") : t("mend.all_joints"));

const ofCamera = (edit) => ({ camera: edit.camera ?? t("mend.all_cameras"), joints: several(edit.joints) });

const KINDS = {
  pin: (edit) => t("mend.kind.pin", { joint: jointWords(edit.joint) }),
  direction: (edit) => t(`mend.direction.${edit.of}`),
  contact: (edit) => t(edit.other && edit.other !== edit.performer ? "mend.kind.contact_other" : edit.touches === "nothing" ? "mend.kind.contact_nothing" : edit.touches === "floor" || !edit.touches ? "mend.kind.contact_floor" : "mend.kind.contact_joint",
    { joint: jointWords(edit.joint), performer: performerWords(edit.other ?? ""), ...(edit.touches in OUTPUT && { other: jointWords(edit.touches) }) }),
  leave_out: (edit) => t("mend.kind.leave_out", ofCamera(edit)),
  exchange_sides: (edit) => t("mend.kind.exchange_sides", ofCamera(edit)),
  offset: (edit) => t("mend.kind.offset", { joint: edit.joint, degrees: (edit.rotation_deg ?? [0, 0, 0]).map((one) => number(one)).join(" ") }),
  trim: () => t("mend.kind.trim"),
  retime: (edit) => t("mend.kind.retime", { factor: number(edit.factor, 2) }),
};

/** Return the description of an edit. */
export const wordsOf = (edit) => KINDS[edit.kind](edit);

const at = (time_s) => clock(Math.max(secondsOf(time_s), 0));

/** Return what a pin found wrong and repaired, one line each. */
export function foundBy(found) {
  const when = { joints: several(found.joints), from: at(found.start_s), to: at(found.end_s) };
  return [
    found.cameras.length ? t("mend.found", { ...when, cameras: found.cameras.join(", ") }) : t("mend.found_unseen", when),
    ...found.exchanges.map((one) => t("mend.found_exchange", { camera: one.camera, at: at(one.time_s) })),
    ...(found.guessed ? [t("mend.found_guess")] : []),
  ];
}
