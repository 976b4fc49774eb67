// The page: loads the switches and the view's state, then follows the server's events.
import { byId, setText } from "../base/dom.js";
import { updateAccess } from "../access/access.js";
import { eventsUrl, getNextTake, getSettings, getSwitches, getView, putSettings } from "../base/api.js";
import { follow } from "../base/events.js";
import { timeOfDay, unknown, watchPicture } from "../base/fresh.js";
import { attempt, showError, showNext, showNote } from "../base/messages.js";
import { updateCalibration } from "../calibration/calibration.js";
import { forgetMeasured, startCompare, toggleCompare, updateCompare, updateCompareTakes } from "../compare/compare.js";
import { updateCameras } from "../cameras/cameras.js";
import { hearDevices } from "../cameras/devices.js";
import { updateEdits } from "../edits/panel.js";
import { updateBodies } from "../replay/bodies.js";
import { updateDisk } from "./disk.js";
import { startFrame } from "../base/frame.js";
import { updateNextStep } from "./next_step.js";
import { hearJobs, isUnderWay } from "../base/jobs.js";
import { outputRobots, outputsFor, startOutputs } from "./outputs.js";
import { startSet, updateSet } from "../record/set.js";
import { startRigid, updateRigid } from "./rigid.js";
import { startKeys } from "./keys.js";
import { measureAnew, startLatency } from "./latency.js";
import { replayed, solved, startReplay, updateReplay, updateReplayTakes } from "../replay/replay.js";
import { arrangePanels, showPanel, startPanels } from "./panels.js";
import { startPerformer, updatePerformer } from "../calibration/performer.js";
import { said } from "../base/said.js";
import { language, number, t } from "../base/strings.js";
import { Switches } from "../solve/switches.js";
import { startImport } from "../takes/import.js";
import { foundTakes, loadFound, takeOf } from "../takes/found.js";
import { selectedIds } from "../takes/selection.js";
import { startTakes, updatePictures, updateTakes } from "../takes/takes.js";
import { startTrash } from "../takes/trash.js";
import { updateLevels } from "../cameras/levels.js";
import { setRole } from "../base/role.js";
import { forgetTransport, startTransport, updateNextTake, updateTransport } from "../record/transport.js";
import { updatePeople } from "../people/people.js";
import { startWarnings, updateWarnings } from "./warnings.js";
import { TRIAL, solveTrial, updateTrial } from "../replay/trial.js";
import { startWorkList, updateWorkList } from "../work/work_list.js";
import { startViewTools, updateView } from "../view/view_tools.js";
import { announce, seeReplay } from "../view/viewpoint.js";
import { setNotice, setStale } from "../view/viewer.js";
import { updateWizard } from "../calibration/wizard.js";

const MANY_JOINTS = 6; // more than a limb's: not a joint that is lost, but somebody else
const FILES = ["report", "export", "robot"]; // jobs that leave the take as it is
const OWN_WORDS = [...FILES, "calibrate", "import"]; // jobs whose end is told where they were begun
const CHOSEN = "switches"; // what the switches of a replayed take were set to, over a reload
const SAVED_MS = 2500; // a take that another browser stopped is on disk by then

const state = {
  colours: {}, people: [], takes: null, jobs: null, cameras: "", recording: false, problem: "", switches: null, replayed: "", devices: [], status: null, heardAt: 0, pictureFrom: null, loaded: false,
};

function showConnection(connection) {
  document.body.dataset.connection = connection;
  setText(byId("connection").querySelector(".text"), t(`connection.${connection}`));
  if (connection === "gone") {
    state.jobs = null; // a server that comes back counts them anew
    drawTakes();
    updateTrial([], replayed());
    updateWorkList(null, state.takes);
    if (state.status) showStatus(unknown(state.status));
  }
  showAge();
  if (connection === "open") {
    measureAnew();
    attempt(load).then(() => {
      state.loaded = true;
      showPanels();
    });
  }
}

/** Show over the picture since when it is out of date. */
function showAge() {
  const gone = document.body.dataset.connection === "gone";
  const from = gone ? state.heardAt || performance.now() : state.pictureFrom;
  setStale(from === null ? "" : t(gone ? "stale.server" : "stale.picture", { time: timeOfDay(language(), performance.now() - from) }));
}

/** Request everything that the events do not carry. */
async function load() {
  const [view, switches, settings] = await Promise.all([getView(), getSwitches(), getSettings()]);
  state.colours = view.colours;
  updateView(view);
  if (state.switches) state.switches.update(switches);
  else state.switches = new Switches(switches, () => (replayed().open ? replayed().take : ""), applySettings, loadPresets);
  state.switches.show(settings);
  state.replayed = "";
  await Promise.all([loadTakes(), updateAccess().then(setRole).then(announce)]);
}

/** Set the switches to what is shown: as last set for the replayed take, else those of the stage. */
function followReplay(replay) {
  const shown = replay.open ? replay.take : "";
  arrangePanels(replay.open);
  setText(byId("solve-title-fold"), t(replay.open ? "solve.this_take" : "solve.title"));
  drawTakes();
  if (shown && state.takes && !takeOf(shown) && shown !== state.replayed) attempt(loadTakes); // another browser's
  if (shown === state.replayed || !state.switches) return;
  showNext();
  state.replayed = shown;
  const kept = JSON.parse(sessionStorage.getItem(CHOSEN) ?? "null");
  if (shown && kept?.take === shown) state.switches.show(kept);
  else if (!shown) attempt(async () => state.switches.show(await getSettings()));
}

/** Request the presets again, and use the named one. */
async function loadPresets(name) {
  state.switches.update(await getSwitches());
  if (name && name !== state.switches.preset) state.switches.use({ preset: name, values: { ...state.switches.presets[name] } });
}

/** Apply the switches to the replayed take, else to the live stage. Refused settings are reverted. */
async function applySettings(chosen) {
  const replay = replayed();
  if (replay.open) {
    sessionStorage.setItem(CHOSEN, JSON.stringify({ take: replay.take, preset: chosen.preset, set: chosen.changes() }));
    await solveTrial(replay.take, chosen);
    return true;
  }
  try {
    await putSettings(chosen.preset, chosen.changes());
  } catch (error) {
    showError(error.message);
    await attempt(async () => chosen.show(await getSettings()));
    return false;
  }
  return true;
}

async function loadTakes() {
  const { take, ghost } = replayed();
  const worked = (state.jobs ?? []).map((job) => job.take).filter((id) => id?.includes("/"));
  const [takes, next] = await Promise.all([loadFound([take, ghost?.take, ...selectedIds(), ...worked].filter(Boolean)), getNextTake()]);
  state.takes = takes;
  updateReplayTakes(takes);
  updateCompareTakes(takes);
  updateNextTake(next.name);
  drawTakes();
}

function drawTakes() {
  if (!state.switches || !state.takes) return;
  const running = (state.jobs ?? []).filter((job) => isUnderWay(job) && !FILES.includes(job.kind));
  const byTake = Object.fromEntries(running.map((job) => [job.take, job]));
  const last = Object.fromEntries((state.jobs ?? []).map((job) => [job.take, job]));
  const failed = Object.fromEntries(Object.values(last).filter((job) => job.state === "failed" && job.kind === "solve").map((job) => [job.take, job]));
  updateTakes({ running: byTake, failed }, () => ({ preset: state.switches.preset, set: state.switches.changes() }));
}

/** Show the state of the jobs; one that has ended brings new files. */
function showJobs(jobs) {
  const before = Object.fromEntries((state.jobs ?? jobs).map((job) => [job.id, job]));
  state.jobs = jobs;
  const ended = jobs.filter((job) => !isUnderWay(job) && (!before[job.id] || isUnderWay(before[job.id])));
  const done = ended.filter((job) => job.state === "done" && job.kind === "solve");
  for (const job of done) solved(job.take, job.name);
  for (const job of ended) {
    if (job.kind === "robot" && job.state === "failed") showError(said(job.message));
    if (OWN_WORDS.includes(job.kind)) continue;
    if (job.kind === "draft") continue; // the solve that follows says what is wrong
    if (job.state === "failed") showError(t("take.solve_failed", { name: job.take, solve: job.name, reason: said(job.message) }));
    else if (job.state === "done" && job.name !== TRIAL) showNote(t("take.solved_as", { name: job.take, solve: job.name }));
  }
  updateTrial(jobs.filter(isUnderWay), replayed());
  if (done.length) forgetMeasured();
  if (ended.length) attempt(loadTakes);
  else drawTakes();
}

function noticeOf(status) {
  if (status.stale || replayed().open) return "";
  const connected = Object.values(status.cameras).some((camera) => camera.connected);
  if (!connected) return t("notice.no_camera");
  if (status.pipeline.preparing) return t("notice.preparing");
  if (status.calibration.state === "none") return t("notice.waiting");
  if (status.pipeline.rate_hz === 0) return t("notice.nobody");
  if (Object.keys(status.pipeline.not_followed_mm).length > MANY_JOINTS) return t("notice.not_followed");
  return "";
}

function showStatus(status) {
  const ready = Object.values(status.cameras).some((camera) => camera.connected);
  const names = Object.keys(status.cameras).join();
  if (names !== state.cameras) {
    state.cameras = names;
    attempt(async () => { state.colours = (await getView()).colours; });
  }
  const { borrowed, attempt: { state: walked } } = status.calibration;
  updateCameras(status.cameras, state.colours, status.recording.active, { ...state.local, borrowed, calibrated: walked === "done", devices: state.devices });
  updateDisk(status);
  updateLevels(status.cameras, state.colours);
  updateWarnings(status);
  updateCalibration(status, state.colours, ready);
  updatePerformer(status, ready);
  updatePeople(status, state.people);
  outputsFor(status.performers.filter((one) => one.number).map((one) => one.name));
  updateWizard(status, state.colours);
  const { active, take, seconds, problem } = status.recording;
  if (active !== state.recording) {
    state.recording = active;
    attempt(loadTakes);
    if (!active) setTimeout(() => attempt(loadTakes), SAVED_MS);
  }
  if (problem && problem !== state.problem) showError(said(problem));
  state.problem = problem;
  if (status.stale) forgetTransport();
  else updateTransport(active ? { take, seconds } : null, ready);
  setNotice(noticeOf(status));
  updateNextStep(status, state.takes && foundTakes().total, replayed().open);
}

/** Show the panels all at once, when their content is loaded: rows that appear one by one move what is under the pointer. */
function showPanels() {
  if (state.status && state.loaded) delete document.body.dataset.loading;
}

function showMessage(message) {
  Object.assign(state, { status: message.status, message, heardAt: performance.now() });
  state.local = message.local_cameras;
  state.devices = message.devices;
  state.colours = message.view.colours;
  state.people = message.view.performer_colours;
  showStatus(message.status);
  hearDevices(message.devices, message.status.cameras, message.status.recording.active);
  hearJobs(message.jobs);
  updateWorkList(message.jobs, state.takes);
  if (state.switches) showJobs(message.jobs);
  updateSet(message.status.timecode, message.triggers);
  updateRigid(message.status.bodies);
  updateReplay(message.replay);
  updateEdits(replayed(), message.edits);
  updateBodies(replayed());
  seeReplay(message.replay);
  updatePictures(message.thumbnails);
  if (state.stamp !== undefined && state.stamp !== message.takes) attempt(loadTakes); // takes came or went, whoever did it
  state.stamp = message.takes;
  updateView(message.view);
  outputRobots(message.view.robots);
  showPanels();
}

/** Show the server's last message again, in another language. */
function sayAgain() {
  const { connection } = document.body.dataset;
  setText(byId("connection").querySelector(".text"), t(`connection.${connection}`));
  showAge();
  if (!state.message || connection !== "open") return;
  showStatus(state.message.status);
  updateView(state.message.view);
  updateWorkList(state.jobs, state.takes);
  drawTakes();
}

startTransport((summary) => {
  showNote(t("record.done", { take: summary.take, seconds: number(summary.seconds, 1) }));
  if (summary.problem) showError(said(summary.problem));
  showPanel("takes-title");
  attempt(loadTakes);
});
startPanels();
startPerformer();
startWarnings();
startOutputs();
startSet();
startRigid();
startTakes(loadTakes);
startTrash(loadTakes);
startImport(() => showPanel("takes-title"));
startCompare();
startReplay((replay) => {
  followReplay(replay);
  updateEdits(replay);
  updateBodies(replay);
  updateCompare();
}, toggleCompare);
startWorkList();
startKeys();
startViewTools();
startLatency();
startFrame();
window.addEventListener("language", sayAgain);
watchPicture((from) => {
  state.pictureFrom = from;
  showAge();
}, () => document.body.dataset.connection === "open");
follow(eventsUrl(), { onState: showConnection, onMessage: showMessage });
