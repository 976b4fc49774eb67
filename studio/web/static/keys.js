// The keyboard: one list of shortcuts, for the handler and for the overlay that `?` shows.
import { byId, h } from "./dom.js";
import { undo } from "./messages.js";
import { replayKey } from "./replay.js";
import { canOperate } from "./role.js";
import { t } from "./strings.js";
import { lookFrom } from "./view_tools.js";
import { inTextField, onKey } from "./viewer.js";

const SHORTCUTS = {
  stage: [["R", "record"], ["T", "t_pose"], ["Ctrl Z", "undo"], ["?", "help"]],
  replay: [
    ["Space", "play"], ["← →", "step"], ["Shift ← →", "step_ten"], ["Home End", "ends"], ["I O", "range"], ["L", "loop"], ["Esc", "live"],
  ],
  view: [["1", "front"], ["2", "side"], ["3", "top"], ["4", "orbit"], ["5", "whole"], ["F", "follow"]],
};
const VIEWPOINTS = { 1: "front", 2: "side", 3: "top", 4: "orbit", 5: "stage", f: "follow" };

function showHelp() {
  const dialog = byId("help");
  if (dialog.open) {
    dialog.close();
    return;
  }
  if (!dialog.firstChild) {
    dialog.append(h("h2", {}, t("keys.title")), h("div", { class: "shortcuts" }, Object.entries(SHORTCUTS).map(([title, rows]) => h("section", {},
      h("h3", {}, t(`keys.${title}`)),
      h("dl", {}, rows.flatMap(([keys, what]) => [h("dt", {}, keys.split(" ").map((key) => h("kbd", {}, key))), h("dd", {}, t(`keys.${what}`))]))))),
    h("form", { method: "dialog" }, h("button", { type: "submit" }, t("message.close"))));
  }
  dialog.showModal();
}

function handle(event) {
  if (inTextField(event) || (!canOperate() && event.key !== "?")) return;
  const key = event.key.toLowerCase();
  if (key === "z" && (event.ctrlKey || event.metaKey) && undo()) event.preventDefault();
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]:not(#help)")) return;
  if (event.key === "?") showHelp();
  else if (byId("help").open) return;
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
  byId("help-button").addEventListener("click", showHelp);
}
