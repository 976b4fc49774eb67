// The list of takes: solve again with the switches as set, and export.
import { byId, clock, h, plural, redraw, setText } from "./dom.js";
import { exportLink, solveTake } from "./api.js";
import { attempt, showNote } from "./messages.js";

const FORMATS = ["bvh", "fbx"];

function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const today = new Date().toDateString() === date.toDateString();
  const time = date.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit" });
  return today ? time : `${date.toLocaleDateString([], { day: "numeric", month: "short" })} ${time}`;
}

function solveRow(take, solve) {
  return h("li", { class: "solve-row" },
    h("span", { class: "name", title: `Solve ${solve}` }, solve),
    FORMATS.map((format) => h("a", {
      class: "button small", href: exportLink(take, solve, format), download: `${take.name}_${solve}.${format}`,
      aria: { label: `Export ${take.name}, ${solve}, as ${format.toUpperCase()}` },
    }, format.toUpperCase())));
}

function row(take, job, settings) {
  const solving = job !== undefined && job.state === "running";
  const button = h("button", {
    class: "small", type: "button", disabled: solving || take.recording,
    title: "Solve this take with the preset and switches as set",
    aria: { label: `Solve ${take.name}` },
    onclick: () => attempt(async () => {
      const name = await solveTake(take, settings());
      showNote(`Solving ${take.name} as ${name}`);
    }),
  }, solving ? "Solving" : "Solve");
  return h("li", { class: "take" },
    h("div", { class: "take-head" },
      h("span", { class: "name", title: `${take.session} / ${take.name}` }, take.name),
      h("span", { class: "when" }, [take.seconds === null ? "" : clock(take.seconds), when(take.created)].filter(Boolean).join("  ·  ")),
      button),
    solving && h("progress", { max: 1, value: job.progress, aria: { label: `Solving ${take.name}` } }),
    take.solves.length > 0 && h("ul", {}, take.solves.map((solve) => solveRow(take, solve))));
}

/** Show the takes, newest first; `jobs`: running solves by take id; `settings`: returns preset and switches as set. */
export function updateTakes(takes, jobs, settings) {
  setText(byId("takes-count"), takes.length ? plural(takes.length, "take") : "");
  redraw(byId("takes"), [takes, jobs], () => takes.length
    ? h("ul", {}, takes.map((take) => row(take, jobs[take.id], settings)))
    : h("p", { class: "empty" }, "No takes yet. Press R or the Record button to make one."));
}
