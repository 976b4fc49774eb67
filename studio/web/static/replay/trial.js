// The replayed take solved with the switches as set: asked for, its progress over the timeline, shown once it is there.
import { h, setText } from "../base/dom.js";
import { solveTake } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { t } from "../base/strings.js";

/** How far the trial of the replayed take is: words that fill what is left of a row of the replay's bar, and its upper edge. */
export const trial = h("span", { id: "trial", class: "trial", role: "status" },
  h("span", {}), h("progress", { max: 1, value: 0, hidden: true, aria: { label: t("trial.progress") } }));

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
  const [words, bar] = trial.children;
  bar.hidden = mine.length === 0;
  setText(words, mine.length ? t(mine[0].kind === "draft" ? "trial.draft" : "trial.solving") : "");
  trial.title = words.textContent;
  if (mine.length) bar.value = mine[0].progress;
}
