// Background jobs of the server: callers that started one get its progress and result.
import { said } from "./said.js";
import { t } from "./strings.js";

const waiting = new Map(); // id -> {onProgress, done, failed}
const ENDED = ["done", "failed", "cancelled"];
const last = new Map(); // id -> the job as the server last said

function tell(job) {
  const one = waiting.get(job.id);
  if (!one) return;
  if (ENDED.includes(job.state)) {
    waiting.delete(job.id);
    if (job.state === "done") one.done(job);
    else one.failed(job.state === "failed" ? new Error(said(job.message)) : new DOMException(t("work.was_cancelled"), "AbortError"));
    return;
  }
  one.onProgress?.(job.state === "waiting" ? null : job.progress);
}

/**
 * Return the job once it is done; `onProgress` is called with the share done, null while it waits. Throws an error with the
 * reason if it failed, an AbortError if it was cancelled.
 */
export function ended(job, onProgress) {
  return new Promise((done, failed) => {
    waiting.set(job.id, { onProgress, done, failed });
    tell(last.get(job.id) ?? job);
  });
}

/** Whether a job is waiting, running or being cancelled. */
export const isUnderWay = (job) => job.state === "waiting" || job.state === "running" || job.state === "cancelling";

/** Handle the server's list of jobs. */
export function hearJobs(jobs) {
  last.clear();
  for (const job of jobs) {
    last.set(job.id, job);
    tell(job);
  }
}
