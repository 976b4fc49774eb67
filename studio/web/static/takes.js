// The list of takes: solve again with the switches as set, and export.
import { byId, clock, h, plural, redraw, setText } from "./dom.js";
import { solveTake } from "./api.js";
import { download, showExport } from "./exports.js";
import { attempt, showNote } from "./messages.js";
import { open } from "./replay.js";

const FORMATS = ["bvh", "fbx"];

function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const today = new Date().toDateString() === date.toDateString();
  const time = date.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  return today ? time : `${date.toLocaleDateString([], { day: "numeric", month: "short" })} ${time}`;
}

function solveRow(take, solve) {
  const buttons = FORMATS.map((format) => h("button", {
    class: "small", type: "button", onclick: (event) => download(take, solve, { format }, event.currentTarget),
    aria: { label: `Export ${take.name}, solve ${solve}, as ${format.toUpperCase()}` },
  }, format.toUpperCase()));
  buttons.push(h("button", {
    class: "small", type: "button", onclick: () => showExport(take, solve), title: "Other formats and options",
    aria: { label: `Export ${take.name}, solve ${solve}, with options` },
  }, "…"));
  const play = h("button", {
    class: "small", type: "button", onclick: () => open(take.id, solve), aria: { label: `Replay ${take.name}, solve ${solve}` },
    title: "Show this solve in the view",
  }, "▶");
  return h("li", { class: "solve-row" }, play, h("span", { class: "name", title: `Solve ${solve}` }, solve), buttons);
}

/** The preset's name where it is free or solved with the preset as it stands, else numbered. */
function solveName(take, settings) {
  const changed = Object.keys(settings.set).length > 0;
  if (!changed) return settings.preset;
  let number = 2;
  while (take.solves.includes(`${settings.preset}_${number}`)) number += 1;
  return `${settings.preset}_${number}`;
}

function row(take, job, settings) {
  const solving = job !== undefined;
  const button = h("button", {
    class: "small", type: "button", disabled: solving || take.recording,
    title: "Solve this take with the preset and switches as set",
    aria: { label: `Solve ${take.name}` },
    onclick: () => attempt(async () => {
      const chosen = settings();
      const { name } = await solveTake(take, solveName(take, chosen), chosen);
      showNote(`Solving ${take.name} as ${name}`);
    }),
  }, solving ? "Solving" : "Solve");
  return h("li", { class: "take" },
    h("div", { class: "take-head", title: take.problem || take.notes || take.id },
      h("span", { class: "name" }, take.name),
      h("span", { class: "when" }, [take.seconds === null ? "" : clock(take.seconds), when(take.created)].filter(Boolean).join("  ·  ")),
      button),
    solving && h("progress", { max: 1, value: job.progress, id: `progress-${take.id}`, aria: { label: `Solving ${take.name}` } }),
    take.problem && h("p", { class: "fair" }, take.problem),
    take.solves.length > 0 && h("ul", {}, take.solves.map((solve) => solveRow(take, solve))));
}

/** Show the takes, newest first; `jobs`: solves under way by take id; `settings`: returns preset and switches as set. */
export function updateTakes(takes, jobs, settings) {
  setText(byId("takes-count"), takes.length ? plural(takes.length, "take") : "");
  redraw(byId("takes"), [takes, Object.keys(jobs)], () => takes.length
    ? h("ul", {}, takes.map((take) => row(take, jobs[take.id], settings)))
    : h("p", { class: "empty" }, "No takes yet. Press R or the Record button to make one."));
  for (const [id, job] of Object.entries(jobs)) {
    const bar = byId(`progress-${id}`);
    if (bar) bar.value = job.progress;
  }
}
