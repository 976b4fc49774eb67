// The page: loads the switches and the view's state, then follows the server's events.
import { byId, setText } from "./dom.js";
import { eventsUrl, getSettings, getSwitches, getTakes, getView, putSettings } from "./api.js";
import { follow } from "./events.js";
import { attempt } from "./messages.js";
import { updateCalibration } from "./calibration.js";
import { updateCameras } from "./cameras.js";
import { Switches } from "./switches.js";
import { updateTakes } from "./takes.js";
import { startTransport, updateTransport } from "./transport.js";
import { setNotice, showLayers } from "./viewer.js";

const CONNECTION_WORDS = {
  connecting: "Connecting",
  open: "Connected",
  gone: "The server does not answer. Trying again",
};

const state = { colours: {}, takes: [], jobs: {}, cameras: "", switches: null };

function showConnection(connection) {
  document.body.dataset.connection = connection;
  setText(byId("connection").querySelector(".text"), CONNECTION_WORDS[connection]);
  if (connection === "gone") {
    updateTransport(null, false);
    setNotice("");
  }
  if (connection === "open") attempt(load);
}

/** Ask for everything that the events do not carry. */
async function load() {
  const [view, switches, settings] = await Promise.all([getView(), getSwitches(), getSettings()]);
  state.colours = view.colours;
  showLayers(view.layers);
  state.switches ??= new Switches(switches, (chosen) => attempt(() => putSettings(chosen.preset, chosen.changes())));
  state.switches.show(settings);
  await loadTakes();
}

async function loadTakes() {
  state.takes = await getTakes();
  drawTakes();
}

function drawTakes() {
  updateTakes(state.takes, state.jobs, () => ({ preset: state.switches.preset, set: state.switches.changes() }));
}

function noticeOf(status) {
  const connected = Object.values(status.cameras).some((camera) => camera.connected);
  if (!connected) return "No camera is connected";
  if (status.calibration.state === "none") return "Waiting for a performer";
  if (status.pipeline.rate_hz === 0) return "No performer in view";
  return "";
}

function showStatus(status) {
  const ready = Object.values(status.cameras).some((camera) => camera.connected);
  const names = Object.keys(status.cameras).join();
  if (names !== state.cameras) {
    state.cameras = names;
    attempt(async () => { state.colours = (await getView()).colours; });
  }
  updateCameras(status.cameras, state.colours);
  updateCalibration(status.calibration, state.colours, ready);
  const { active, take, seconds } = status.recording;
  updateTransport(active ? { take, seconds } : null, ready);
  setNotice(noticeOf(status));
}

startTransport();
follow(eventsUrl(), { onState: showConnection, onMessage: (message) => showStatus(message) });
