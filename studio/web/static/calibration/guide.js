// Texts and sounds of the wizard and the remote control: turns the stage's status into a step, words, a number, and sounds.
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";
import { reasonsOf } from "./verdict.js";

export const STEPS = ["cameras", "walk", "verdict", "pose", "done"];
export const GATHERING = ["gathering", "computing"];
export const POSING = ["countdown", "holding", "computing"];
const POSE_S = 4; // of the calibration, for the T-pose at its beginning
const GATHERED = 0.9; // share of the progress at which all frames are there

const connected = (status) => Object.values(status.cameras).filter((camera) => camera.connected);

/** Whether nobody hears the instructions: all cameras are simulated, and so is the performer. */
export const simulated = (status) => connected(status).length > 0 && connected(status).every((camera) => camera.device.startsWith("simulated"));

/** Return the current step of the stage, given the previous one. */
export function stepOf(status, before) {
  const { attempt, tpose } = status.calibration;
  if (status.stale) return before;
  if (GATHERING.includes(attempt.state)) return "walk";
  if (POSING.includes(tpose.state)) return "pose";
  if (before === "walk") return "verdict";
  if (before === "pose" && tpose.state === "done") return "done";
  return before;
}

/** Return the seconds left for gathering a calibration's frames. */
export function walkLeft(attempt) {
  return Math.max(0, attempt.seconds * (1 - attempt.progress / GATHERED));
}

/** Return the verdict on the whole stage: that of its worst camera, or refused. */
export function verdictOf(attempt) {
  if (attempt.state === "failed") return "refused";
  const verdicts = Object.values(attempt.cameras).map((camera) => camera.verdict);
  return verdicts.every((verdict) => verdict === "good") ? "good" : "usable";
}

function camerasSaying(status) {
  const here = connected(status);
  if (!here.length) return { tone: "bad", big: t("wizard.no_camera"), small: t("wizard.no_camera_do") };
  const bad = here.filter((camera) => camera.state !== "live" || (camera.limited_by && camera.limited_by !== "no_performer"));
  if (bad.length) return { tone: "fair", big: t("wizard.camera_trouble", { n: bad.length }), small: said(bad[0].reason) };
  return { tone: "good", big: t("wizard.cameras_ready", { n: here.length }), small: t(simulated(status) ? "wizard.simulated" : "wizard.stand") };
}

function walkSaying(attempt, alone) {
  if (attempt.state === "computing") return { tone: "busy", big: t("wizard.computing"), small: t("wizard.computing_hint") };
  const left = walkLeft(attempt);
  const posing = left - (attempt.seconds - POSE_S);
  if (posing > 0 && !alone) return { tone: "busy", big: t("wizard.hold_t"), small: t("wizard.face_reference"), seconds: posing, kind: "pose" };
  const seen = Object.values(attempt.coverage);
  const all = seen.length > 0 && seen.every((camera) => camera.enough);
  return { tone: all ? "good" : "busy", big: t(alone ? "wizard.simulated_walk" : "wizard.walk"), small: t(all ? "wizard.enough" : alone ? "wizard.simulated" : "wizard.walk_hint"), seconds: left, kind: "walk" };
}

function verdictSaying(attempt) {
  const verdict = verdictOf(attempt);
  const reasons = reasonsOf(attempt.cameras);
  const tone = { good: "good", usable: "fair", refused: "bad" }[verdict];
  const small = reasons.length ? "" : attempt.state === "failed" ? said(attempt.message) : t("wizard.agree");
  return { tone, big: t(`wizard.verdict.${verdict}`), small, reasons };
}

function poseSaying(calibration, alone) {
  const { state, seconds_left: left, problems, message, height_m: height } = calibration.tpose;
  const wrong = alone && problems.length ? t("wizard.simulated_wait") : problems.map(said).join("; ");
  if (state === "countdown") return { tone: problems.length ? "fair" : "busy", big: t("wizard.t_pose_in"), small: wrong, seconds: left, kind: "countdown" };
  if (state === "holding" && wrong) return { tone: "fair", big: t("wizard.not_yet"), small: wrong };
  if (state === "holding") return { tone: "good", big: t("wizard.hold_still"), small: "", seconds: Math.max(left, 0), kind: "hold" };
  if (state === "computing") return { tone: "busy", big: t("wizard.measuring"), small: "" };
  if (state === "failed") return { tone: "bad", big: t("wizard.pose_failed"), small: said(message) };
  if (state === "done") return { tone: "good", big: `${number(height, 2)} m`, small: t("wizard.measured") };
  return { tone: "plain", big: t("wizard.t_pose"), small: t(alone ? "wizard.simulated_pose" : "wizard.t_pose_hint") };
}

/** Return what is shown at a step: `tone`, `big` and `small` words, a countdown in `seconds` (of a `kind`), `reasons`. */
export function sayingOf(status, step) {
  const { calibration } = status;
  if (status.stale) return { tone: "plain", big: t("stale.unknown"), small: t("connection.gone"), reasons: [] };
  if (step === "cameras") return camerasSaying(status);
  if (step === "walk") return walkSaying(calibration.attempt, simulated(status));
  if (step === "verdict") return verdictSaying(calibration.attempt);
  if (step === "pose") return poseSaying(calibration, simulated(status));
  const height = calibration.height_m;
  return { tone: "good", big: t("wizard.ready"), small: height ? t("wizard.ready_height", { height: number(height, 2) }) : "" };
}

/** Return the sounds for the changes between two calibration states. */
export function soundsOf(before, after) {
  if (!before) return [];
  const was = { walk: before.attempt.state, pose: before.tpose.state };
  const now = { walk: after.attempt.state, pose: after.tpose.state };
  const sounds = [];
  if (was.walk !== now.walk) sounds.push(...({ gathering: ["go"], computing: ["step"], done: ["success"], failed: ["refusal"] }[now.walk] ?? []));
  if (was.pose !== now.pose) sounds.push(...({ holding: ["go"], computing: ["step"], done: ["success"], failed: ["refusal"] }[now.pose] ?? []));
  const enough = (state) => Object.values(state.attempt.coverage).filter((camera) => camera.enough).length;
  if (now.walk === "gathering" && was.walk === "gathering" && enough(after) > enough(before)) sounds.push("step");
  return sounds;
}
