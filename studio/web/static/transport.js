// Record and stop: the button, the R key, the timer and the take's name.
import { byId, clock, setText } from "./dom.js";
import { startRecording, stopRecording } from "./api.js";
import { attempt } from "./messages.js";
import { t } from "./strings.js";
import { inTextField, onKey } from "./viewer.js";

let recording = null; // {take, seconds} as the server last said
let receivedAt = 0;
let busy = false;

async function toggle(onStopped) {
  const button = byId("record");
  if (busy || button.disabled) return;
  busy = true;
  if (recording) {
    const summary = await attempt(stopRecording);
    if (summary) onStopped(summary);
  } else {
    await attempt(() => startRecording(byId("take-name").value.trim()));
  }
  busy = false;
}

function tick() {
  const seconds = recording ? recording.seconds + (performance.now() - receivedAt) / 1000 : 0;
  setText(byId("timer"), clock(seconds, true));
  if (recording) requestAnimationFrame(tick);
}

/** Connect the button and the key; `onStopped` hears the summary of a take that is on disk. */
export function startTransport(onStopped) {
  byId("record").addEventListener("click", () => toggle(onStopped));
  onKey((event) => {
    if (event.key.toLowerCase() !== "r" || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (inTextField(event) || event.target.closest?.("dialog")) return;
    event.preventDefault();
    toggle(onStopped);
  });
}

/** Show whether the stage records (`{take, seconds}` or null) and whether it could. */
export function updateTransport(now, possible) {
  const began = now && !recording;
  const ended = !now && recording;
  recording = now;
  receivedAt = performance.now();
  const button = byId("record");
  button.disabled = !possible && !now;
  button.setAttribute("aria-pressed", String(Boolean(now)));
  button.title = now ? t("record.stop_hint", { take: now.take }) : t(possible ? "record.start_hint" : "record.no_camera");
  setText(button.querySelector(".label"), t(now ? "record.stop" : "record.start"));
  document.body.classList.toggle("recording", Boolean(now));
  byId("take-name").disabled = Boolean(now);
  if (began) { byId("take-name").value = now.take; tick(); }
  if (ended) { byId("take-name").value = ""; tick(); }
}
