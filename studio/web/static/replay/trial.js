// The replayed take solved with the switches as set: requested, with its progress over the timeline, and shown once ready.
import { h, setText } from "../base/dom.js";
import { solveTake } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { t } from "../base/strings.js";

/** Progress of the replayed take's trial: words in the rest of a row of the replay's bar, and a bar at its upper edge. */
export const trial = h("span", { id: "trial", class: "trial", role: "status" },
  h("span", {}), h("progress", { max: 1, value: 0, hidden: true, aria: { label: t("trial.progress") } }));

/** Name of the solve that the switches make of the replayed take. */
export const TRIAL = "trial";

/** Solve a take with the switches as set; the part around the playhead is shown first, as a draft. */
export async function solveTrial(takeId, chosen) {
  const [session, name] = takeId.split("/");
  const settings = { preset: chosen.preset, set: chosen.changes() };
  const ask = (more) => attempt(() => solveTake({ session, name }, TRIAL, { ...settings, ...more }));
  if (await ask({ draft: true })) await ask({});
}

/** Show the progress of the replayed take's trial; `jobs`: those under way. */
export function updateTrial(jobs, replay) {
  const mine = replay.open ? jobs.filter((job) => job.take === replay.take && job.name === TRIAL) : [];
  const [words, bar] = trial.children;
  bar.hidden = mine.length === 0;
  setText(words, mine.length ? t(mine[0].kind === "draft" ? "trial.draft" : "trial.solving") : "");
  trial.title = words.textContent;
  if (mine.length) bar.value = mine[0].progress;
}
