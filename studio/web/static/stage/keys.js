// The keyboard: one list of shortcuts, for the handler and for the help.
import { byId } from "../base/dom.js";
import { undo } from "../base/messages.js";
import { makeAgain } from "../edits/list.js";
import { replayKey } from "../replay/replay.js";
import { canOperate } from "../base/role.js";
import { toggleWorkList } from "../work/work_list.js";
import { lookFrom } from "../view/viewpoint.js";
import { inTextField, onKey } from "../view/viewer.js";
import { toggleHelp } from "./help.js";

const SHORTCUTS = {
  stage: [["R", "record"], ["T", "t_pose"], ["Ctrl Z", "undo"], ["Ctrl Shift Z", "redo"], ["W", "work"], ["?", "help"]],
  replay: [
    ["Space", "play"], ["← →", "step"], ["Shift ← →", "step_ten"], ["Home End", "ends"], ["I O", "range"], ["[ ]", "range"], ["L", "loop"], ["M", "marker"], ["C", "curves"], ["J", "joint"], ["P", "pin"], ["Shift C", "curves_of"], ["V", "video"], ["+ − 0", "zoom"], ["Esc", "live"],
  ],
  view: [["1", "front"], ["2", "side"], ["3", "top"], ["4", "orbit"], ["5", "whole"], ["6", "motion"], ["F", "follow"]],
};
const VIEWPOINTS = { 1: "front", 2: "side", 3: "top", 4: "orbit", 5: "stage", 6: "motion", f: "follow" };

function handle(event) {
  const key = event.key.toLowerCase();
  if (inTextField(event) || !(canOperate() || key === "?" || VIEWPOINTS[key])) return;
  if (key === "z" && (event.ctrlKey || event.metaKey) && (event.shiftKey ? makeAgain() : undo())) event.preventDefault();
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]:not(#help)")) return;
  if (event.key === "?") toggleHelp(SHORTCUTS);
  else if (byId("help").open) return;
  else if (key === "w") toggleWorkList();
  else if (VIEWPOINTS[key]) lookFrom(VIEWPOINTS[key]);
  else if (key === " " && event.target.closest?.("button, input, summary, a")) return; // it presses what has the focus
  else if (!replayKey(event)) return;
  event.preventDefault();
}

/** Listen for the keys of replay and view, on the page and inside the 3D view. */
export function startKeys() {
  onKey(handle);
  document.addEventListener("click", (event) => { // a click leaves no focus behind, so that Space plays
    if (event.detail > 0) event.target.closest?.("button")?.blur();
  });
  byId("help-button").addEventListener("click", () => toggleHelp(SHORTCUTS));
}
