// Record and stop: the button, the R key, the countdown before, the timer, the slate and the take's name.
import { byId, clock, h, setText } from "../base/dom.js";
import { startRecording, stopRecording } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { canOperate } from "../base/role.js";
import { play } from "../base/sound.js";
import { language, t } from "../base/strings.js";
import { inTextField, onKey } from "../view/viewer.js";
import { timecodeNow } from "./set.js";

const COUNTDOWNS = [0, 3, 5, 10];
const KEPT = "countdown";
const SLATE_MS = 2500;
const ENDS = ["verdict", "done"]; // steps of the calibration at which R goes on to recording

let recording = null; // {take, seconds} as the server last said
let known = true; // whether the server said so lately
let receivedAt = 0;
let asked = null; // what the server was asked and has not answered yet
let counting = 0; // the timer of a countdown, 0 where there is none
let next = ""; // name that a take gets by itself

const countdown = () => Number(localStorage.getItem(KEPT) ?? 0);

async function ask(work) {
  const own = asked = {};
  const answer = await attempt(work);
  if (asked === own) asked = null;
  return answer;
}

const begin = () => ask(() => startRecording(byId("take-name").value.trim()));

function showCount(left) {
  const place = byId("countdown");
  place.hidden = left <= 0;
  if (left > 0) {
    setText(place.querySelector(".number"), String(left));
    setText(place.querySelector(".slate-name"), byId("take-name").value.trim() || next || t("record.take"));
  }
}

function cancelCount() {
  clearTimeout(counting);
  counting = 0;
  showCount(0);
  showButton();
}

function count(left) {
  showCount(left);
  if (left <= 0) {
    counting = 0;
    play("go");
    begin();
    return;
  }
  play("tick");
  counting = setTimeout(() => count(left - 1), 1000);
}

async function toggle(onStopped) {
  if (asked || byId("record").disabled || !canOperate()) return;
  if (counting) cancelCount();
  else if (recording) {
    const summary = await ask(stopRecording);
    if (summary) onStopped(summary);
  } else if (countdown() > 0) {
    count(countdown());
    showButton();
  } else await begin();
}

function tick() {
  const seconds = recording ? recording.seconds + (performance.now() - receivedAt) / 1000 : 0;
  setText(byId("timer"), known ? clock(seconds, true) : "–");
  if (recording) requestAnimationFrame(tick);
}

/** Show the slate for a moment: name of the take, day and time of day. */
function showSlate(take) {
  const slate = byId("slate");
  const now = new Date();
  slate.replaceChildren(
    h("strong", {}, take),
    h("span", {}, now.toLocaleDateString(language(), { day: "numeric", month: "long", year: "numeric" })),
    h("span", {}, now.toLocaleTimeString(language())),
    ...(timecodeNow() ? [h("span", { class: "slate-timecode" }, timecodeNow())] : []));
  slate.hidden = false;
  setTimeout(() => { slate.hidden = true; }, SLATE_MS);
}

function showButton(possible = !byId("record").disabled) {
  const button = byId("record");
  button.disabled = !possible && !recording && !counting;
  button.setAttribute("aria-pressed", String(Boolean(recording)));
  button.classList.toggle("counting", Boolean(counting));
  button.title = recording ? t("record.stop_hint", { take: recording.take }) : t(possible ? "record.start_hint" : "record.no_camera");
  setText(button.querySelector(".label"), t(recording ? "record.stop" : counting ? "message.cancel" : "record.start"));
}

/** Connect the button and the key; `onStopped` gets the summary of a take that is on disk. */
export function startTransport(onStopped) {
  byId("record").addEventListener("click", () => toggle(onStopped));
  byId("countdown-seconds").append(...COUNTDOWNS.map((seconds) =>
    h("option", { value: seconds, selected: seconds === countdown() }, seconds ? t("record.seconds", { seconds }) : t("record.at_once"))));
  byId("countdown-seconds").addEventListener("change", (event) => localStorage.setItem(KEPT, event.currentTarget.value));
  onKey((event) => {
    if (event.key === "Escape" && counting) cancelCount();
    if (event.key.toLowerCase() !== "r" || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    const dialog = document.querySelector("dialog[open]");
    if (inTextField(event) || (dialog && !ENDS.includes(dialog.dataset.step))) return;
    event.preventDefault();
    dialog?.close();
    toggle(onStopped);
  });
}

/** Set the next take's default name, which the empty field shows. */
export function updateNextTake(name) {
  next = name;
  byId("take-name").placeholder = next;
}

/** Forget whether the stage records and for how long: its state is unknown. */
export function forgetTransport() {
  if (counting) cancelCount();
  recording = null;
  known = false;
  showButton(false);
  document.body.classList.remove("recording");
  tick();
}

/** Show whether the stage records (`{take, seconds}` or null) and whether it could. */
export function updateTransport(now, possible) {
  const began = now && !recording;
  const ended = !now && recording;
  recording = now;
  known = true;
  receivedAt = performance.now();
  if (began || ended) asked = null; // the answer may come later: who presses R again means to stop, or the next take
  if (counting && !possible && !now) cancelCount();
  showButton(possible);
  document.body.classList.toggle("recording", Boolean(now));
  byId("take-name").disabled = Boolean(now);
  byId("countdown-seconds").disabled = Boolean(now);
  if (began) { byId("take-name").value = now.take; tick(); if (now.seconds < SLATE_MS / 1000) showSlate(now.take); }
  if (ended) byId("take-name").value = "";
  if (!now) tick();
}
