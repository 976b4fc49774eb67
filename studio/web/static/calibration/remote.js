// The remote control on a phone: the current step of the stage, and the three buttons that a performer needs.
import { byId, clock, h, redraw, setText } from "../base/dom.js";
import {
  cancelTPose, eventsUrl, finishCalibration, getView, startCalibration, startRecording, startTPose, stopRecording,
} from "../base/api.js";
import { coverageShare } from "./coverage.js";
import { follow } from "../base/events.js";
import { toneOf, unknown } from "../base/fresh.js";
import { POSING, sayingOf, soundsOf, stepOf } from "./guide.js";
import { colourOf } from "../people/people_colour.js";
import { isMuted, play, setMuted } from "../base/sound.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const TICK_MS = 100;
const state = { step: "cameras", status: null, heardAt: 0, colours: {}, people: [], busy: false, second: null };

/** Do the action of a button, with all buttons disabled meanwhile; a refusal is shown in the place for messages. */
async function act(action) {
  setBusy(true);
  setText(byId("messages"), "");
  try {
    await action();
  } catch (error) {
    setText(byId("messages"), error.message);
  }
  setBusy(false);
}

function setBusy(busy) {
  state.busy = busy;
  if (state.status) show();
}

const calibration = () => state.status.calibration;
const gathering = () => calibration().attempt.state === "gathering";
const posing = () => POSING.includes(calibration().tpose.state);

const ACTIONS = {
  calibrate: () => (gathering() ? finishCalibration() : startCalibration()),
  pose: () => (posing() ? cancelTPose() : startTPose("")),
  record: () => (state.status.recording.active ? stopRecording() : startRecording("")),
};

function setButton(id, words, { enabled, lit = false }) {
  const button = byId(id);
  setText(button, words);
  button.disabled = state.busy || !enabled;
  button.classList.toggle("lit", lit);
}

function showButtons(ready) {
  const { attempt } = calibration(), { recording } = state.status;
  const idle = !posing() && !recording.active;
  setButton("calibrate", t(gathering() ? "calibration.enough" : attempt.state === "computing" ? "calibration.busy" : "calibration.start"),
    { enabled: ready && idle && attempt.state !== "computing", lit: gathering() });
  setButton("pose", t(posing() ? "message.cancel" : "performer.t_pose"), { enabled: ready && !gathering() && !recording.active, lit: posing() });
  const stoppable = recording.active && !state.status.stale;
  setButton("record", stoppable ? `${t("record.stop")}  ${clock(recording.seconds)}` : t(recording.active ? "record.stop" : "record.start"), { enabled: stoppable || (ready && !gathering() && !posing()) });
  byId("record").classList.toggle("recording", stoppable);
}

function cameraRow([name, camera]) {
  const seen = gathering() ? calibration().attempt.coverage[name] : null;
  const median = calibration().attempt.estimates?.[name]?.residual_median_mm;
  return h("li", {}, h("span", { class: "swatch", style: `background:${state.colours[name] ?? "var(--muted)"}` }), h("strong", {}, name),
    seen ? h("progress", { max: 1, value: coverageShare(seen), aria: { label: t("wizard.map_share", { name }) } })
      : h("span", { class: toneOf(camera) }, t(`camera.state.${camera.state}`)),
    seen && typeof median === "number" ? h("span", { class: "figure", title: t("wizard.estimate_hint") }, `${number(median)} mm`)
      : h("span", { class: "muted" }, !camera.connected ? "–" : seen ? `${number(100 * coverageShare(seen))} %` : t("camera.fps", { fps: number(camera.fps) })));
}

function personRow(one) {
  return h("li", {}, h("span", { class: "swatch", style: `background:${colourOf(one, state.people)}` }), h("strong", {}, one.name || t("people.stranger")),
    h("span", {}, t(`people.state.${one.state}`)), h("span", { class: "muted" }, one.height_m ? `${number(one.height_m, 2)} m` : ""));
}

/** Show all people on a stage of several performers, and the warnings about them. */
function showPeople({ performers, performer_warnings: warnings }) {
  redraw(byId("people"), [performers, warnings, state.people], () => [
    ...performers.map(personRow), ...warnings.map((words) => h("li", { class: "person-warning" }, said(words))),
  ]);
}

function show() {
  const { status } = state;
  const cameras = Object.entries(status.cameras).sort();
  const saying = status.recording.active && !status.stale ? { tone: "recording", big: t("remote.recording"), small: status.recording.take } : sayingOf(status, state.step);
  byId("saying").dataset.tone = saying.tone;
  setText(byId("big"), saying.big);
  setText(byId("small"), saying.small);
  redraw(byId("reasons"), saying.reasons ?? [], () => (saying.reasons ?? []).map(([name, why, what]) => h("li", {}, `${name}: ${why}`, what && h("b", {}, what))));
  redraw(byId("cameras"), [state.step, state.colours, gathering() && [calibration().attempt.coverage, calibration().attempt.estimates], cameras.map(([name, { state: now, fps }]) => [name, now, Math.round(fps)])], () => cameras.map(cameraRow));
  showPeople(status);
  showButtons(cameras.some(([, camera]) => camera.connected));
  count();
}

/** Update the countdown, also between two statuses. */
function count() {
  if (!state.status) return;
  const saying = state.status.recording.active && !state.status.stale ? {} : sayingOf(state.status, state.step);
  const running = saying.seconds !== undefined;
  byId("number").hidden = !running;
  if (!running) return;
  const second = Math.ceil(Math.max(0, saying.seconds - (performance.now() - state.heardAt) / 1000));
  setText(byId("number"), String(second));
  if (second !== state.second && second > 0 && saying.kind !== "walk") play("tick");
  state.second = second;
}

function hear({ status }) {
  for (const sound of soundsOf(state.status?.calibration, status.calibration)) play(sound);
  Object.assign(state, { step: stepOf(status, state.step), heardAt: performance.now() });
  state.status = status;
  show();
}

function showConnection(connection) {
  document.body.dataset.connection = connection;
  setText(byId("connection").querySelector(".text"), t(`connection.${connection}`));
  if (connection === "gone" && state.status) {
    state.status = unknown(state.status);
    show();
  }
  if (connection === "open") act(async () => { ({ colours: state.colours, performer_colours: state.people } = await getView()); });
}

function showSound() {
  setText(byId("remote-sound"), t(isMuted() ? "wizard.sound_off" : "wizard.sound_on"));
  byId("remote-sound").setAttribute("aria-pressed", String(!isMuted()));
}

for (const [id, action] of Object.entries(ACTIONS)) byId(id).addEventListener("click", () => act(action));
byId("remote-sound").addEventListener("click", () => { setMuted(!isMuted()); showSound(); });
showSound();
setInterval(count, TICK_MS);
follow(eventsUrl(), { onState: showConnection, onMessage: hear });
