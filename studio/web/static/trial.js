// The replayed take solved with the switches as set: asked for, its progress over the timeline, shown once it is there.
import { byId, h, setText } from "./dom.js";
import { solveTake } from "./api.js";
import { attempt } from "./messages.js";
import { t } from "./strings.js";

/** Name of the solve that the switches make of the take that is replayed. */
export const TRIAL = "trial";

/** Solve a take with the switches as set; what is around the playhead is shown first, as a draft. */
export async function solveTrial(takeId, chosen) {
  const [session, name] = takeId.split("/");
  const settings = { preset: chosen.preset, set: chosen.changes() };
  const ask = (more) => attempt(() => solveTake({ session, name }, TRIAL, { ...settings, ...more }));
  if (await ask({ draft: true })) await ask({});
}

/** Show how far the trial of the replayed take is; `jobs`: those under way. */
export function updateTrial(jobs, replay) {
  const mine = replay.open ? jobs.filter((job) => job.take === replay.take && job.name === TRIAL) : [];
  if (!byId("trial")) {
    byId("replay").prepend(h("div", { id: "trial", class: "trial", role: "status", hidden: true },
      h("span", {}), h("progress", { max: 1, value: 0, aria: { label: t("trial.progress") } })));
  }
  const strip = byId("trial");
  strip.hidden = mine.length === 0;
  if (!mine.length) return;
  const [job] = mine;
  setText(strip.firstChild, t(job.kind === "draft" ? "trial.draft" : "trial.solving"));
  strip.lastChild.value = job.progress;
}
