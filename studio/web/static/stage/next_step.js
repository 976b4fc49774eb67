// The next step, over the view: for those who open the studio for the first time, and whenever something is missing.
import { showAddCamera, startSimulated } from "../cameras/add_camera.js";
import { byId, h, redraw } from "../base/dom.js";
import { canOperate } from "../base/role.js";
import { t } from "../base/strings.js";

const STEPS = ["cameras", "calibrate", "record"];
const BUSY = ["gathering", "computing"];

/** Return the missing step, "" if there is none: with a take, only cameras and calibration can be missing. */
function stepOf(status, count, replaying) {
  if (replaying || status.recording.active || BUSY.includes(status.calibration.attempt.state)) return "";
  if (!Object.values(status.cameras).some((camera) => camera.connected)) return "cameras";
  if (["none", "provisional"].includes(status.calibration.state)) return "calibrate";
  return count === 0 ? "record" : "";
}

const ACTS = {
  cameras: showAddCamera,
  calibrate: () => byId("calibrate")?.click(),
  record: () => byId("record").click(),
};

function build(step) {
  const at = STEPS.indexOf(step);
  return [
    h("ol", { class: "guide-steps" }, STEPS.map((name, i) => h("li", { class: i < at ? "done" : i === at ? "now" : "" , aria: i === at ? { current: "step" } : {} }, t(`guide.${name}`)))),
    h("p", { class: "guide-words" }, t(`guide.${step}_words`)),
    h("div", { class: "buttons operate" },
      h("button", { class: "primary", type: "button", onclick: ACTS[step] }, t(`guide.${step}_act`)),
      step === "cameras" && h("button", { type: "button", onclick: startSimulated }, t("guide.simulated_act"))),
  ];
}

/** Show the next step; `count`: how many takes there are, null before that is known. */
export function updateNextStep(status, count, replaying) {
  const step = canOperate() && !status.stale ? stepOf(status, count, replaying) : "";
  byId("guide").hidden = !step;
  byId("guide").dataset.step = step;
  if (step) redraw(byId("guide"), step, () => build(step));
}
