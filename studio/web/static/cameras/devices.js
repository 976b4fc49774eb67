// The devices on the server's machine in the dialog that adds cameras: a picture of each, Connect and Disconnect.
import { connectDevice, disconnectDevice, getDevices, searchDevices, takeDevicePicture } from "../base/api.js";
import { byId, h, redraw } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";
import { showAnnounced } from "./announced.js";
import { labelOf } from "./camera_command.js";

const LOOK_MS = 500, REST_MS = 2000; // while something is about to change, and else: cameras on the network come and go
const SIMULATED = "simulated";
const state = { list: null, clicked: "", cameras: {}, recording: false, asked: new Set(), taking: "", dialog: null, timer: 0 };

const isSimulated = ({ kind }) => kind.startsWith(SIMULATED);
const nameOf = ({ device }) => said(device);
const canOpen = ({ state: now }) => now === "free" || now === "ended";

/** Handle what the server reports four times a second: the devices connected by a click, and the cameras. */
export function hearDevices(clicked, cameras, recording) {
  Object.assign(state, { cameras, recording });
  const key = JSON.stringify(clicked);
  if (key === state.clicked) return;
  state.clicked = key;
  if (state.dialog?.open) look();
}

/** Start searching for devices, and show them in the elements `devices` and `simulated-devices` while the dialog is open. */
export async function showDevices(dialog) {
  Object.assign(state, { dialog, list: null, asked: new Set() });
  dialog.addEventListener("close", () => clearTimeout(state.timer), { once: true });
  await search();
}

async function search() {
  state.list = (await attempt(searchDevices)) ?? state.list;
  state.asked.clear();
  draw();
  follow();
}

async function look() {
  clearTimeout(state.timer);
  state.list = (await getDevices().catch(() => null)) ?? state.list; // a server that is away is told by the page
  draw();
  await showAnnounced();
  follow();
}

/** Schedule the next request, sooner while the list is about to change, and take the next picture. */
function follow() {
  clearTimeout(state.timer);
  if (!state.dialog.open || !state.list) return;
  const busy = state.list.searching || state.list.devices.some((one) => one.state === "starting");
  state.timer = setTimeout(look, busy ? LOOK_MS : REST_MS);
  nextPicture();
}

/** Have pictures taken of free devices, one after the other. */
async function nextPicture() {
  const next = state.list.devices.find((one) => canOpen(one) && !one.pictures && !one.picture_problem && !state.asked.has(one.id));
  if (state.taking || !next || state.recording) return;
  await picture(next.id);
  if (state.dialog.open) await look();
}

async function picture(id) {
  state.asked.add(id);
  state.taking = id;
  draw();
  await takeDevicePicture(id).catch(() => null); // it was connected meanwhile: its own picture comes
  state.taking = "";
}

async function pictureAgain(id) {
  if (state.taking) return;
  await attempt(() => picture(id));
  await look();
}

async function act(action) {
  await attempt(action);
  await look();
}

function draw() {
  const { devices, searching, unknown } = state.list ?? { devices: [], searching: true, unknown: [] };
  const real = devices.filter((one) => !isSimulated(one));
  fill(byId("devices"), real);
  fill(byId("simulated-devices"), devices.filter(isSimulated));
  redraw(byId("devices-none"), [searching, real.length, unknown.length], () => [
    h("p", { class: "muted", role: "status" }, searching ? t("devices.searching") : t(real.length ? "devices.plug_more" : "devices.none"))]);
  redraw(byId("devices-unknown"), unknown, () => (unknown.length ? h("details", {},
    h("summary", {}, t("devices.unknown", { n: unknown.length })),
    h("ul", {}, unknown.map(({ kind, problem }) => h("li", {}, h("strong", {}, labelOf(kind)), ": ", said(problem))))) : []));
  byId("devices-search").disabled = searching;
}

/** Show devices in a list; unchanged parts of a device stay, with what is typed in them. */
function fill(list, devices) {
  const rows = devices.map((one) => byId(`device-${one.id}`) ?? h("li", { class: "device", id: `device-${one.id}` },
    h("div", { class: "look" }), h("div", { class: "about" }), h("div", { class: "act" })));
  if (rows.length !== list.children.length || rows.some((row, k) => row !== list.children[k])) list.replaceChildren(...rows);
  devices.forEach((one, k) => {
    const [seen, words, acts] = rows[k].children, taking = state.taking === one.id;
    const live = one.state === "connected" && state.cameras[one.camera]?.previews > 0;
    redraw(seen, [one.state, one.camera, one.pictures, one.picture_problem, taking, live], () => sight(one, taking, live));
    redraw(words, [one.device, one.serial, one.state, one.camera, one.needs, one.problem], () => about(one));
    const held = acts.contains(document.activeElement);
    redraw(acts, [one.state, one.name], () => acting(one));
    if (held && !acts.contains(document.activeElement)) acts.querySelector("button")?.focus(); // what was pressed is gone
  });
}

function sight(device, taking, live) {
  const alt = t("devices.sees", { device: nameOf(device) });
  if (live) return h("img", { src: `/api/v1/cameras/${encodeURIComponent(device.camera)}/preview?n=${Date.now()}`, alt });
  if (taking) return h("p", { class: "muted" }, t("devices.taking"));
  if (device.pictures) return h("img", { src: `/api/v1/devices/${device.id}/picture?n=${device.pictures}`, alt });
  if (canOpen(device) && device.picture_problem) return h("p", { class: "muted" }, said(device.picture_problem));
  return h("p", { class: "muted" }, t("devices.no_picture"));
}

const TONES = { connected: "good", ended: "bad", lacks: "fair", in_use: "fair" };

function about(device) {
  const { needs, problem, serial, camera: name } = device;
  const now = device.state === "free" ? "" : t(`devices.state.${device.state}`, { name });
  return [
    h("p", { class: "name" }, nameOf(device), serial && h("span", { class: "muted" }, ` ${serial}`)),
    now && h("p", { class: `now ${TONES[device.state] ?? "muted"}`, role: "status" }, now),
    device.state === "lacks" && h("p", { class: "words" }, said(needs)),
    problem && h("p", { class: `words ${device.state === "ended" ? "bad" : ""}` }, said(problem)),
  ].filter(Boolean);
}

function acting(device) {
  const { id } = device, words = { device: nameOf(device) };
  if (device.state === "starting" || device.state === "connected") {
    return h("button", { id: `act-${id}`, type: "button", aria: { label: t("devices.disconnect_label", words) }, onclick: () => act(() => disconnectDevice(id)) }, t("devices.disconnect"));
  }
  if (!canOpen(device)) return [];
  const name = h("input", { id: `name-${id}`, type: "text", maxLength: 63, value: device.name, required: true, spellcheck: false, aria: { label: t("devices.name", words) } });
  const connect = (event) => { event.preventDefault(); act(() => connectDevice(id, name.value.trim())); };
  return h("form", { onsubmit: connect }, name,
    h("button", { id: `act-${id}`, class: "primary", type: "submit", aria: { label: t("devices.connect_label", words) } }, t("devices.connect")),
    h("button", { class: "small", type: "button", aria: { label: t("devices.again_label", words) }, onclick: () => pictureAgain(id) }, t("devices.again")));
}

/** Return the part of the dialog with the devices that are plugged in. */
export const devicesPart = () => h("section", { class: "devices" },
  h("div", { class: "devices-head" }, h("h3", {}, t("devices.title")),
    h("button", { class: "small", id: "devices-search", type: "button", onclick: search }, t("devices.search"))),
  h("ul", { id: "devices" }), h("div", { id: "devices-none" }), h("div", { id: "devices-unknown" }));
