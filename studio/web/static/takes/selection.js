// Actions on several takes at once: solve, export, compare, splice, tag, throw away.
import { byId, h, redraw } from "../base/dom.js";
import { changeTake, restoreTake, solveTake, throwTake } from "../base/api.js";
import { askName } from "../base/ask.js";
import { openCompare } from "../compare/compare.js";
import { askExport } from "../export/export.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { open } from "../replay/replay.js";
import { t } from "../base/strings.js";
import { askSplice } from "./splice.js";
import { bestSolve, freeName, uncalibrated } from "./take_row.js";

const chosen = new Map(); // id -> the take as it was last known
let list = null; // {changed, settings, show}

const alter = (action) => attempt(async () => { await action(); await list.changed(); });
const takes = () => [...chosen.values()];
const solved = () => takes().filter((take) => take.solves.length);
const solvable = () => takes().filter((take) => !uncalibrated(take) && !take.recording);

const RESTORE = undoing("trash-many", (ids) => alter(async () => { for (const id of ids) await restoreTake(id); }));
const RETAG = undoing("tags-many", (before) => alter(async () => { for (const [take, tags] of before) await changeTake(take, { tags }); }));

/** Whether a take is selected. */
export const isSelected = (take) => chosen.has(take.id);

/** The ids of the takes that are selected. */
export const selectedIds = () => [...chosen.keys()];

/** Select or deselect a take. */
export function select(take, wanted) {
  if (wanted) chosen.set(take.id, take);
  else chosen.delete(take.id);
  showSelection();
}

/** Select exactly these takes. */
export function selectAll(some) {
  chosen.clear();
  for (const take of some) chosen.set(take.id, take);
  list.show();
}

/** Update the selected takes, and deselect those that are gone. `known`: finds a take by its id. */
export function refreshSelection(known) {
  for (const id of chosen.keys()) {
    const take = known(id);
    if (take) chosen.set(id, take);
    else chosen.delete(id);
  }
}

async function solveAll() {
  const settings = list.settings();
  const begun = solvable();
  await attempt(async () => { for (const take of begun) await solveTake(take, freeName(take, settings), settings); });
  showNote(t("selected.solving", { n: begun.length }));
}

const exportAll = () => askExport(solved().map((take) => ({ take, solve: bestSolve(take) })));

async function compareTwo() {
  const [a, b] = solved();
  await open(a.id, bestSolve(a), { take: b.id, solve: bestSolve(b) });
  openCompare();
}

const spliceAll = () => alter(() => askSplice(solved().map((take) => ({ take, solve: bestSolve(take) }))));

async function tagAll() {
  const text = await askName(t("selected.tag_title", { n: chosen.size }), t("take.tags"), "", t("message.save"));
  if (!text) return;
  const added = text.split(",").map((tag) => tag.trim()).filter(Boolean);
  const before = takes().map((take) => [{ session: take.session, name: take.name }, take.tags]);
  await alter(async () => {
    for (const take of takes()) await changeTake(take, { tags: [...take.tags, ...added] });
    showUndo(t("selected.tagged", { n: before.length, tags: added.join(", ") }), RETAG, before);
  });
}

async function throwAll() {
  const ids = [];
  await alter(async () => {
    try {
      for (const take of takes()) {
        ids.push((await throwTake(take)).id);
        chosen.delete(take.id);
      }
    } finally {
      if (ids.length) showUndo(t("selected.in_trash", { n: ids.length }), RESTORE, ids);
    }
  });
}

function acts() {
  const small = (id, act, possible, why) => h("button", {
    id: `selected-${id}`, class: "small", type: "button", onclick: act, disabled: !possible, title: possible ? t(`selected.${id}_hint`) : why,
  }, t(`selected.${id}`));
  return [
    h("p", { class: "selected-count", role: "status" }, h("strong", {}, t("selected.count", { n: chosen.size })),
      h("button", { class: "small quiet", type: "button", id: "selected-none", onclick: () => selectAll([]) }, t("selected.none"))),
    h("div", { class: "selected-acts", role: "group", aria: { label: t("selected.acts") } },
      small("solve", solveAll, solvable().length, t("selected.not_calibrated")),
      small("export", exportAll, solved().length, t("selected.not_solved")),
      small("compare", compareTwo, chosen.size === 2 && solved().length === 2, t("selected.two")),
      small("splice", spliceAll, solved().length > 1, t("selected.splice_some")),
      small("tag", tagAll, true, ""),
      small("trash", throwAll, true, "")),
  ];
}

/** Show the actions on the selected takes. */
export function showSelection() {
  redraw(byId("takes-selected"), takes().map((take) => [take.id, take.solves, take.tags, take.calibrated, take.recording]), () => (chosen.size ? acts() : []));
}

/** Start; `changed` reloads the takes, `settings` returns preset and switches as set, `show` draws the list. */
export function startSelection(how) {
  list = how;
}
