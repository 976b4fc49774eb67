// The list of the server's jobs: running, waiting and ended ones, their remaining time, and how to cancel them.
import { cancelJob, clearJobs, exportAddress, reportAddress } from "../base/api.js";
import { byId, clock, h, redraw, setText } from "../base/dom.js";
import { isUnderWay } from "../base/jobs.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { language, t } from "../base/strings.js";
import { open } from "../replay/replay.js";
import { bestSolve } from "../takes/take_row.js";

const SEEN = "work-seen"; // when the newest failure ended that was looked at
const list = { jobs: null, takes: null };

const isOpen = () => !byId("work").hidden;
const titleOf = (job) => t(`work.kind.${job.kind}`, { name: job.name });
const whatOf = (job) => (job.take ? `${titleOf(job)}, ${job.take}` : titleOf(job));
const minutes = (seconds) => clock(seconds).split(".")[0];

/** Whether a job is listed: drafts and replaced jobs are not, once they have ended. */
const isListed = (job) => isUnderWay(job) || (job.state !== "replaced" && job.kind !== "draft");

function stateOf(job) {
  if (job.state !== "running") return t(`work.state.${job.state}`);
  const step = job.step ? t(`work.step.${job.step}`) : "";
  const left = job.left_s === null ? t("work.so_far", { time: minutes(job.seconds ?? 0) }) : t("work.left", { time: minutes(job.left_s) });
  return [step, left].filter(Boolean).join(" · ");
}

function endOf(job) {
  const at = new Date(job.ended).toLocaleTimeString(language(), { hour: "2-digit", minute: "2-digit" });
  const took = job.seconds === null ? "" : t("work.took", { time: minutes(job.seconds) });
  return [t(`work.state.${job.state}`), at, took].filter(Boolean).join(" · ");
}

const link = (text, label, href, props = {}) => h("a", { class: "button small", href, aria: { label }, ...props }, text);

/** Return the control for what a job has made, or null. */
function fruitOf(job) {
  const show = (solve) => h("button", {
    class: "small", type: "button", aria: { label: t("work.show_label", { name: `${job.take} ${solve}` }) }, onclick: () => open(job.take, solve),
  }, t("work.show"));
  if (job.kind === "export") return link(t("work.download"), t("work.download_label", { name: job.name }), exportAddress(job.id), { download: job.name });
  if (job.kind === "report") return link(t("work.open"), t("work.open_label", { name: job.name }), reportAddress(job.take, job.name), { target: "_blank", rel: "noopener" });
  const take = list.takes?.find((one) => one.id === job.take);
  if (job.kind === "solve" && take?.solves.includes(job.name)) return show(job.name);
  if (job.kind === "import" && take && bestSolve(take)) return show(bestSolve(take));
  return null;
}

function row(job) {
  const going = isUnderWay(job);
  const stops = going && job.state !== "cancelling" && (job.can_cancel || job.state === "waiting");
  return h("li", { class: `work-row ${job.state}` },
    h("span", { class: "name", title: whatOf(job) }, titleOf(job)),
    h("span", { class: "acts" },
      stops && h("button", {
        class: "small", id: `work-cancel-${job.id}`, type: "button", title: t("work.cancel_hint"), aria: { label: t("work.cancel_label", { what: whatOf(job) }) },
        onclick: () => attempt(() => cancelJob(job.id)),
      }, t("work.cancel")),
      job.state === "done" && fruitOf(job)),
    job.take && h("span", { class: "muted whose" }, job.take),
    h("span", { class: "muted state", id: `work-state-${job.id}` }, going ? stateOf(job) : endOf(job)),
    going && job.state !== "waiting" && h("progress", { id: `work-progress-${job.id}`, max: 1, aria: { label: t("work.progress", { what: whatOf(job) }) } }),
    job.state === "failed" && h("p", { class: "bad" }, said(job.message)));
}

function section(key, jobs, more = null) {
  if (!jobs.length) return null;
  return h("section", { class: "panel", aria: { label: t(`work.${key}`) } },
    h("header", {}, h("h3", {}, t(`work.${key}`)), h("span", { class: "count" }, String(jobs.length)), more),
    h("ul", {}, jobs.map(row)));
}

function build(jobs) {
  const running = jobs.filter((job) => isUnderWay(job) && job.state !== "waiting");
  const waiting = jobs.filter((job) => job.state === "waiting");
  const ended = jobs.filter((job) => !isUnderWay(job)).sort((a, b) => b.ended.localeCompare(a.ended) || b.id - a.id);
  const clear = h("button", { class: "small quiet", id: "work-clear", type: "button", title: t("work.clear_hint"), onclick: () => attempt(clearJobs) }, t("work.clear"));
  const sections = [section("running", running), section("waiting", waiting), section("ended", ended, clear)].filter(Boolean);
  return sections.length ? sections : [h("section", { class: "panel" }, h("p", { class: "empty" }, t("work.none")))];
}

/** Show next to the button how many jobs are under way, or that some have failed since the list was looked at. */
function showCount(jobs) {
  const going = jobs.filter(isUnderWay).length;
  const failed = jobs.filter((job) => job.state === "failed");
  const newest = failed.reduce((last, job) => (job.ended > last ? job.ended : last), "");
  if (isOpen() && newest) sessionStorage.setItem(SEEN, newest);
  const unseen = failed.filter((job) => job.ended > (sessionStorage.getItem(SEEN) ?? "")).length;
  const count = byId("work-count");
  setText(count, going ? String(going) : unseen ? "!" : "");
  count.classList.toggle("failed", !going && unseen > 0);
  const words = [going ? t("work.count", { n: going }) : "", unseen ? t("work.failed_count", { n: unseen }) : ""].filter(Boolean).join(", ");
  count.hidden = !words;
  count.setAttribute("aria-label", words);
}

function show() {
  const jobs = (list.jobs ?? []).filter(isListed);
  showCount(jobs);
  if (!isOpen()) return;
  const shown = jobs.map((job) => [job.id, job.state, job.take, job.name, job.message, job.state === "done" && Boolean(fruitOf(job))]);
  redraw(byId("work-list"), list.jobs && shown, () => (list.jobs ? build(jobs) : h("section", { class: "panel" }, h("p", { class: "empty" }, t("work.unknown")))));
  for (const job of jobs.filter(isUnderWay)) {
    setText(byId(`work-state-${job.id}`), stateOf(job));
    const bar = byId(`work-progress-${job.id}`);
    if (bar && job.state === "running" && job.progress > 0) bar.value = job.progress;
    else bar?.removeAttribute("value");
  }
}

/** Open the list, or close it. */
export function toggleWorkList(wanted = !isOpen()) {
  byId("work").hidden = !wanted;
  document.body.classList.toggle("working", wanted);
  byId("work-button").setAttribute("aria-expanded", String(wanted));
  show();
  if (wanted) byId("work").scrollIntoView({ block: "start" });
}

/** Set the server's jobs, null if unknown, and the takes. */
export function updateWorkList(jobs, takes) {
  Object.assign(list, { jobs, takes });
  show();
}

/** Connect the button of the list. */
export function startWorkList() {
  byId("work-button").addEventListener("click", () => toggleWorkList());
  byId("work-close").addEventListener("click", () => {
    toggleWorkList(false);
    byId("work-button").focus();
  });
  byId("work").addEventListener("keydown", (event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    byId("work-close").click();
  });
}
