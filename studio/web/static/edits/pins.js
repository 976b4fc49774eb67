// The pins of the replayed take in the 3D view, at their places and with their radii.
import { showPins } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { canOperate } from "../base/role.js";
import { editList } from "./state.js";

const state = { key: "" };

/** Show the pins in the view if they have changed. */
export function drawPins() {
  const { replay, edits, revision, take } = editList();
  if (!replay.open || !replay.solve) state.key = "";
  if (!replay.open || !replay.solve || revision < 0 || !canOperate()) return;
  const pins = edits.filter((edit) => edit.kind === "pin").map(({ place_m, radius_m, on }) => ({ place_m, radius_m, on }));
  const key = JSON.stringify([take, pins]);
  if (key === state.key) return;
  state.key = key;
  attempt(() => showPins(pins));
}
