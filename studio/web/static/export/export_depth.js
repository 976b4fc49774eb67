// Depth in the export dialog: choice of the camera, or why there is no depth.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

/** Return the cameras whose depth can be written: those of a single take, else none. */
export const depthCameras = (jobs) => (jobs.length === 1 ? jobs[0].take.depth : []);

/** Return the choice of the camera. */
export const cameraField = (jobs) => h("label", { class: "field" }, h("span", {}, t("calibration.camera")),
  h("select", { id: "export-camera" }, depthCameras(jobs).map((name) => h("option", { value: name }, name))));

/** Return what a recording of depth is, or why these takes have none. */
export function depthWords(jobs) {
  if (jobs.length !== 1) return t("export.depth.one_take");
  return t(jobs[0].take.depth.length ? "export.depth.what" : "export.depth.none");
}
