// What the export dialog offers of depth: which camera's, or why there is none.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

/** Cameras of the chosen takes whose depth can be written: those of one take, else none. */
export const depthCameras = (jobs) => (jobs.length === 1 ? jobs[0].take.depth : []);

/** The choice of the camera. */
export const cameraField = (jobs) => h("label", { class: "field" }, h("span", {}, t("calibration.camera")),
  h("select", { id: "export-camera" }, depthCameras(jobs).map((name) => h("option", { value: name }, name))));

/** What a recording of depth is, or why these takes give none. */
export function depthWords(jobs) {
  if (jobs.length !== 1) return t("export.depth.one_take");
  return t(jobs[0].take.depth.length ? "export.depth.what" : "export.depth.none");
}
