// The keyboard: one list of shortcuts, for the handler and for the overlay that `?` shows.
import { byId, h } from "./dom.js";
import { putCamera } from "./api.js";
import { attempt } from "./messages.js";
import { replayKey } from "./replay.js";
import { undoThrow } from "./takes.js";
import { inTextField, onKey } from "./viewer.js";

const SHORTCUTS = [
  ["Stage", [["R", "Record, stop"], ["T", "T-pose: countdown, cancel"], ["Ctrl Z", "Put a take back that was thrown away"], ["?", "This list"]]],
  ["Replay", [
    ["Space", "Play, pause"], ["← →", "A frame back, on"], ["Shift ← →", "Ten frames back, on"],
    ["Home End", "First, last frame"], ["I O", "Begin, end of the range"], ["L", "Loop"], ["Esc", "Back to the live stage"],
  ]],
  ["View", [["1", "Front"], ["2", "Side"], ["3", "Top"], ["4", "Turn about the performer"], ["F", "Follow the performer"]]],
];
const VIEWPOINTS = { 1: "front", 2: "side", 3: "top", 4: "orbit", f: "follow" };

function showHelp() {
  const dialog = byId("help");
  if (dialog.open) {
    dialog.close();
    return;
  }
  if (!dialog.firstChild) {
    dialog.append(h("h2", {}, "Keyboard"), h("div", { class: "shortcuts" }, SHORTCUTS.map(([title, rows]) => h("section", {},
      h("h3", {}, title),
      h("dl", {}, rows.flatMap(([keys, what]) => [h("dt", {}, keys.split(" ").map((key) => h("kbd", {}, key))), h("dd", {}, what)]))))),
    h("form", { method: "dialog" }, h("button", { type: "submit" }, "Close")));
  }
  dialog.showModal();
}

function handle(event) {
  if (inTextField(event)) return;
  const key = event.key.toLowerCase();
  if (key === "z" && (event.ctrlKey || event.metaKey) && undoThrow()) event.preventDefault();
  if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]:not(#help)")) return;
  if (event.key === "?") showHelp();
  else if (byId("help").open) return;
  else if (VIEWPOINTS[key]) attempt(() => putCamera(VIEWPOINTS[key]));
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
