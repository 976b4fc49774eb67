// The calibration wizard: full screen, legible from three metres, step by step from cameras to a measured performer.
import { byId, h, redraw, setText, svg } from "../base/dom.js";
import { cancelTPose, finishCalibration, startCalibration, startTPose } from "../base/api.js";
import { coverageMap, coverageShare } from "./coverage.js";
import { toneOf } from "../base/fresh.js";
import { GATHERING, POSING, STEPS, sayingOf, simulated, soundsOf, stepOf, verdictOf } from "./guide.js";
import { attempt } from "../base/messages.js";
import { knownFields, knownNow, knownShown, withoutDepth } from "./known.js";
import { showPhone } from "./phone.js";
import { isMuted, play, setMuted } from "../base/sound.js";
import { number, t } from "../base/strings.js";
import { verdictCards } from "./verdict.js";

const TICK_MS = 100;
const TICKED = { countdown: Infinity, hold: Infinity, pose: Infinity, walk: 3.5 }; // seconds left under which they tick
const CLOSE_MS = 6000; // a wizard that opened by itself leaves by itself

const state = { step: "cameras", status: null, colours: {}, heardAt: 0, second: null, byItself: false, leaving: 0, name: () => "" };

const isOpen = () => Boolean(byId("wizard")?.open);

function button(id, text, onclick, { primary = false, disabled = false, key = "" } = {}) {
  return h("button", { id, type: "button", class: primary ? "primary" : "", disabled, onclick }, text, key && h("kbd", {}, key));
}

const startWalk = () => attempt(() => startCalibration(knownNow(withoutDepth(state.status.cameras))));
const startPose = () => attempt(() => startTPose(state.name()));

function go(step) {
  state.step = step;
  show();
}

function actions() {
  const { calibration, cameras } = state.status;
  const ready = Object.values(cameras).some((camera) => camera.connected);
  const posing = POSING.includes(calibration.tpose.state);
  const calibrated = calibration.state === "good";
  return {
    cameras: () => [button("wizard-walk", t("wizard.start_walk"), startWalk, { primary: true, disabled: !ready }),
      calibrated && button("wizard-skip", t("wizard.to_pose"), () => go("pose"))],
    walk: () => [calibration.attempt.state === "gathering" && button("wizard-enough", t("wizard.finish_walk"), () => attempt(finishCalibration), { primary: enough() })],
    verdict: () => {
      const refused = calibration.attempt.state === "failed";
      return [!refused && button("wizard-pose", t("wizard.to_pose"), () => go("pose"), { primary: true }),
        button("wizard-again", t("wizard.walk_again"), startWalk, { primary: refused })];
    },
    pose: () => [posing ? button("wizard-cancel", t("message.cancel"), () => attempt(cancelTPose), { key: "T" })
      : button("wizard-tpose", t("wizard.start_pose"), startPose, { primary: true, disabled: !ready, key: "T" }),
    !posing && button("wizard-later", t("wizard.skip"), () => go("done"))],
    done: () => [button("wizard-close", t("wizard.finish"), close, { primary: true }), button("wizard-pose", t("wizard.pose_again"), () => go("pose"))],
  }[state.step]().filter(Boolean);
}

const enough = () => Object.values(state.status.calibration.attempt.coverage).every((camera) => camera.enough);

function cameraCards() {
  return Object.entries(state.status.cameras).sort().map(([name, camera]) => h("li", { class: "wizard-card" },
    h("span", { class: "swatch", style: `background:${state.colours[name] ?? "var(--muted)"}` }), h("strong", {}, name),
    h("span", { class: toneOf(camera) }, t(`camera.state.${camera.state}`)),
    camera.connected && h("span", { class: "muted" }, t("camera.fps", { fps: number(camera.fps) }))));
}

/** Return the current distance of a camera's joints to the reference's: a number in large letters, and its meaning. */
function residualNow(name) {
  if (state.status.cameras[name]?.reference) return [h("span", {}, t("camera.reference"))];
  const median = state.status.calibration.attempt.estimates?.[name]?.residual_median_mm;
  return typeof median === "number" ? [h("b", {}, number(median), " mm"), h("span", {}, t("wizard.estimate"))] : [h("b", {}, "–"), h("span", {}, t("wizard.estimate_none"))];
}

function maps() {
  const seen = Object.entries(state.status.calibration.attempt.coverage);
  return seen.map(([name, coverage]) => h("li", { class: "wizard-map" },
    coverageMap(coverage, state.colours[name] ?? "var(--accent)", t("calibration.coverage", { name, points: coverage.points, n: coverage.cells.length })),
    h("p", { class: "wizard-residual", title: t("wizard.estimate_hint") }, residualNow(name)),
    h("div", { class: "wizard-map-head" }, h("span", { class: "swatch", style: `background:${state.colours[name] ?? "var(--muted)"}` }), h("strong", {}, name),
      h("span", { class: coverage.enough ? "good" : "muted" }, coverage.enough ? t("wizard.map_enough") : `${number(100 * coverageShare(coverage))} %`)),
    h("progress", { max: 1, value: coverageShare(coverage), aria: { label: t("wizard.map_share", { name }) } })));
}

function cards() {
  if (state.step === "cameras") return cameraCards();
  if (state.step === "walk") return maps();
  if (state.step === "pose") return [h("li", { class: "wizard-pose" }, posePicture())];
  const { attempt: { cameras }, reference } = state.status.calibration;
  return state.step === "verdict" ? verdictCards(cameras, reference, state.colours) : [];
}

/** Return a picture of the pose for the performer, seen from the front. */
const posePicture = () => svg("svg", { viewBox: "0 0 200 192", role: "img", "aria-label": t("wizard.pose_picture") },
  svg("circle", { cx: 100, cy: 20, r: 14 }), svg("path", { d: "M14 54H186M100 54v60M90 60v56L82 180M110 60v56L118 180M82 180h-12M118 180h12" }));

function frame() {
  const mute = button("wizard-mute", "", () => { setMuted(!isMuted()); show(); });
  return [
    h("div", { class: "wizard-head" }, h("ol", { id: "wizard-steps" }), h("div", { class: "wizard-tools" }, mute,
      button("wizard-phone", t("wizard.phone"), showPhone), button("wizard-leave", t("message.close"), close, { key: "Esc" }))),
    h("div", { class: "wizard-main" },
      h("div", { class: "wizard-saying", role: "status" }, h("p", { id: "wizard-number" }), h("h2", { id: "wizard-big" }), h("p", { id: "wizard-small" })),
      h("ul", { id: "wizard-cards" }), h("div", { id: "wizard-known", class: "known" })),
    h("footer", { id: "wizard-actions" }),
  ];
}

function steps() {
  const now = STEPS.indexOf(state.step);
  return STEPS.map((step, at) => h("li", { class: at < now ? "past" : at === now ? "now" : "", ...(at === now && { aria: { current: "step" } }) },
    h("span", {}, at < now ? "✓" : String(at + 1)), t(`wizard.step.${step}`)));
}

/** Show the current step. */
function show() {
  if (!isOpen() || !state.status) return;
  const saying = sayingOf(state.status, state.step);
  const dialog = byId("wizard");
  dialog.dataset.step = state.step;
  dialog.dataset.tone = saying.tone;
  redraw(byId("wizard-steps"), state.step, steps);
  setText(byId("wizard-big"), saying.big);
  setText(byId("wizard-small"), saying.small);
  setText(byId("wizard-mute"), t(isMuted() ? "wizard.sound_off" : "wizard.sound_on"));
  byId("wizard-mute").setAttribute("aria-pressed", String(!isMuted()));
  const { attempt: walk, tpose, state: calibrated, reference } = state.status.calibration;
  redraw(byId("wizard-cards"), [state.step, state.step === "walk" ? [walk.coverage, walk.estimates] : walk.cameras, reference, state.colours,
    state.step === "cameras" && Object.entries(state.status.cameras).map(([name, { state: now, fps }]) => [name, now, Math.round(fps)])], cards);
  const asks = state.step === "cameras" || (state.step === "verdict" && state.status.calibration.attempt.state === "failed") ? withoutDepth(state.status.cameras) : [];
  redraw(byId("wizard-known"), knownShown(asks), () => knownFields(asks, "wizard", show));
  const ready = Object.values(state.status.cameras).some((camera) => camera.connected);
  redraw(byId("wizard-actions"), [state.step, walk.state, tpose.state, calibrated, ready, state.step === "walk" && enough()], actions);
  count(saying);
}

/** Update the countdown and its ticks, also between two statuses. */
function count(saying = state.status && sayingOf(state.status, state.step)) {
  if (!isOpen() || !saying) return;
  const running = saying.seconds !== undefined;
  byId("wizard-number").hidden = !running;
  const left = running ? Math.max(0, saying.seconds - (performance.now() - state.heardAt) / 1000) : 0;
  const second = running ? Math.ceil(left) : null;
  if (running) setText(byId("wizard-number"), String(second));
  if (running && second > 0 && second !== state.second && left < TICKED[saying.kind]) play("tick");
  state.second = second;
}

function close() {
  byId("wizard").close();
}

function open(byItself) {
  if (isOpen()) return;
  if (!byId("wizard")) {
    document.body.append(h("dialog", { id: "wizard", class: "wizard", aria: { label: t("wizard.title") }, onclose: () => clearTimeout(state.leaving) }, frame()));
  }
  state.byItself = byItself;
  byId("wizard").showModal();
  show();
}

/** Open the wizard at its beginning. */
export function openWizard() {
  state.step = "cameras";
  open(false);
}

/** Handle a status: continue to the current step of the stage. A walk or T-pose started outside it opens the wizard. The walk
 * of a simulated performer does not, so that the performer stays visible. */
export function updateWizard(status, colours) {
  const before = state.status?.calibration;
  Object.assign(state, { status, colours, heardAt: performance.now() });
  const step = stepOf(status, state.step);
  const begins = before && ((GATHERING.includes(status.calibration.attempt.state) && !GATHERING.includes(before.attempt.state) && !simulated(status))
    || (POSING.includes(status.calibration.tpose.state) && !POSING.includes(before.tpose.state)));
  if (step !== state.step) clearTimeout(state.leaving);
  const measured = step === "done" && state.step === "pose";
  const agreed = step === "verdict" && state.step === "walk" && verdictOf(status.calibration.attempt) !== "refused";
  if (state.byItself && (measured || agreed)) state.leaving = setTimeout(close, CLOSE_MS);
  state.step = step;
  if (begins) open(true);
  if (isOpen()) for (const sound of soundsOf(before, status.calibration)) play(sound);
  show();
}

/** Start; `name` returns the typed name of the performer, for the T-pose. */
export function startWizard(name) {
  state.name = name;
  byId("remote-link").addEventListener("click", (event) => {
    event.preventDefault();
    showPhone();
  });
  setInterval(count, TICK_MS);
}
