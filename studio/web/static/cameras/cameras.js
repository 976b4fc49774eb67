// The cameras panel: name, colour, frame rate, latency and health in words.
import { showAddCamera, startSimulated } from "./add_camera.js";
import { addressForOthers, onlyHere } from "../base/address.js";
import { chooseReference, disconnectDevice, letCameraGo, stopLocalCameras } from "../base/api.js";
import { commandBox, commandOf } from "./camera_command.js";
import { byId, h, redraw, setText } from "../base/dom.js";
import { toneOf } from "../base/fresh.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const KEPT_SHOWN = 60; // a second of two cameras is always on its way

function health(camera) {
  const going = camera.state === "live" || camera.state === "trouble";
  if (going && camera.limited_by) return [t(`camera.limited_by.${camera.limited_by}`), "fair"];
  if (camera.state === "live" && !camera.calibrated) return [t("camera.not_calibrated"), "fair"];
  return [t(`camera.state.${camera.state}`), toneOf(camera)];
}

const signed = (value, digits) => `${value < 0 ? "−" : "+"}${number(Math.abs(value), digits)}`;

/** Return rate, delay, clock error and confidence as `[name, value]`. */
function figures(camera) {
  const { error_ms: error } = camera.clock;
  const shown = (value, text) => (value === null || value === undefined ? "–" : text);
  return [
    ["rate", shown(camera.fps, t("camera.fps", { fps: number(camera.fps ?? 0) }))],
    ["delay", shown(camera.latency_ms, `${number(camera.latency_ms ?? 0)} ms`)],
    ["step", shown(error, `± ${number(error ?? 0, 1)} ms`)],
    ["sure", shown(camera.confidence, `${number(100 * (camera.confidence ?? 0))} %`)],
  ];
}

/** Return the offset and drift of the camera's clock against the stage clock, for the tooltip. */
function clockWords(camera) {
  const { offset_ms: offset, drift_ppm: drift } = camera.clock;
  const parts = [t("camera.step_hint")];
  if (offset !== null && !camera.reference) {
    const far = Math.abs(offset) < 1e5 ? `${signed(offset, 1)} ms` : `${signed(offset / 1000, 0)} s`;
    parts.push(t("camera.clock", { offset: far, drift: signed(drift, 0) }));
  }
  return parts.join(" ");
}

/** Return what is unusual: lost frames, disagreement with the other cameras, clock jumps, frames kept by the client. */
function remarks(camera) {
  const parts = [];
  if (camera.loss_percent) parts.push(t("camera.lost", { percent: number(camera.loss_percent) }));
  if (camera.apart_mm && camera.limited_by !== "moved") parts.push(t("camera.apart", { mm: number(camera.apart_mm) }));
  if (camera.clock.jumps) parts.push(t("camera.jumps", { n: camera.clock.jumps }));
  if (camera.kept_by_client > KEPT_SHOWN) parts.push(t("camera.kept", { n: camera.kept_by_client }));
  if (camera.unknown_by_client) parts.push(t("camera.unknown", { n: camera.unknown_by_client }));
  if (camera.not_kept_by_client) parts.push(t("camera.not_kept", { n: camera.not_kept_by_client }));
  return parts.join("  ·  ");
}

/** Return the address of a camera's preview; it changes with every tenth preview, so that the picture is fetched again. */
const preview = (name, camera) => `/api/v1/cameras/${encodeURIComponent(name)}/preview?n=${Math.floor(camera.previews / 10)}`;

function row(name, camera, colour, device) {
  const [words, tone] = health(camera);
  const hints = { rate: t("camera.rate_hint"), delay: t("camera.delay_hint", { spread: number(camera.jitter_ms ?? 0, 1) }), step: clockWords(camera), sure: t("camera.sure_hint") };
  return h("li", { class: "camera" },
    h("span", { class: "swatch", style: `background:${colour}`, aria: { hidden: "true" } }),
    h("span", { class: "name", title: camera.device }, name, camera.reference && h("span", { class: "tag", title: t("camera.reference_hint") }, t("camera.reference"))),
    h("span", { class: `health ${tone}` }, h("span", { class: "dot", aria: { hidden: "true" } }), words),
    camera.connected && h("dl", { class: "figures" }, figures(camera).map(([key, value]) =>
      h("div", { title: hints[key] }, h("dt", {}, t(`camera.${key}`)), h("dd", {}, value)))),
    camera.connected && remarks(camera) && h("p", { class: "words" }, remarks(camera)),
    camera.reason && h("p", { class: "words" }, said(camera.reason)),
    camera.connected && camera.previews > 0 && h("img", { class: "preview", src: preview(name, camera), alt: t("camera.sees", { name }) }),
    device && h("button", { class: "small disconnect operate", id: `disconnect-${device.id}`, type: "button", aria: { label: t("devices.disconnect_label", { device: name }) },
      onclick: () => attempt(() => (device.network ? letCameraGo : disconnectDevice)(device.id)) }, t("devices.disconnect")));
}

/** Return a choice of the camera whose clock is the stage clock; separate from the list, which is redrawn all the time. */
function reference(names, now) {
  const select = h("select", {
    id: "reference", title: t("camera.reference_hint"),
    onchange: () => attempt(() => chooseReference(select.value)),
  }, names.map((name) => h("option", { value: name, selected: name === now }, name)));
  return h("label", { class: "field reference" }, h("span", {}, t("camera.reference_label")), select);
}

function updateReference(cameras, recording) {
  const names = Object.keys(cameras).sort().filter((name) => cameras[name].connected);
  const now = names.find((name) => cameras[name].reference) ?? "";
  const shown = names.length > 1 && !recording;
  redraw(byId("cameras-reference"), [names, now, shown], () => (shown ? reference(names, now) : []));
}

/** Return the devices whose clients ended by themselves, and why. */
const ended = (devices) => devices.filter((one) => one.state === "ended").map(({ id, camera, problem }) => h("div", { class: "ended" },
  h("p", { class: "words bad" }, `${camera}: ${said(problem)}`),
  h("div", { class: "buttons operate" },
    h("button", { class: "small", type: "button", onclick: () => showAddCamera() }, t("devices.connect_again")),
    h("button", { class: "small", type: "button", onclick: () => attempt(() => disconnectDevice(id)) }, t("message.dismiss")))));

/** Return what to do while no camera has ever connected. */
function nobody(devices) {
  return h("div", { class: "no-camera" },
    h("p", { class: "empty" }, t("cameras.none")),
    ended(devices),
    h("div", { class: "buttons operate" },
      h("button", { class: "primary", type: "button", onclick: startSimulated }, t("cameras.simulate")),
      h("button", { type: "button", onclick: () => showAddCamera() }, t("cameras.add_more"))),
    h("p", { class: "empty" }, t("cameras.by_command")),
    commandBox(commandOf("SOURCE", { server: addressForOthers() })),
    onlyHere() && h("p", { class: "empty" }, t("cameras.only_here")));
}

/** Return the part about cameras on the server's machine, with buttons to stop them and to add more. */
function below(local) {
  const broken = Object.entries(local.cameras).filter(([, camera]) => !camera.running && camera.problem);
  return [
    local.opened && h("p", { class: "words" }, t(local.opened !== "simulated" ? "cameras.playing" : local.performers > 1 ? "cameras.simulated_several" : "cameras.simulated", { n: local.performers, name: local.opened.replace(/^\w+\//, "") })),
    local.opened && local.opened !== "simulated" && (local.borrowed || !local.calibrated)
      && h("p", { class: `words ${local.borrowed ? "" : "fair"}` }, t(local.borrowed ? "cameras.borrowed" : "cameras.not_borrowed")),
    ...ended(local.devices),
    ...broken.map(([name, { problem }]) => h("p", { class: "words bad" }, `${name}: ${said(problem)}`)),
    h("div", { class: "buttons" },
      h("button", { class: "small", id: "add-camera", type: "button", onclick: () => showAddCamera() }, t("cameras.add")),
      local.opened && h("button", { class: "small", id: "stop-local", type: "button", onclick: () => attempt(stopLocalCameras) }, t("cameras.stop"))),
  ].filter(Boolean);
}

/** Show the cameras of a status (by name) in their colours, and those on the server's machine (`local`). */
export function updateCameras(cameras, colours, recording, local) {
  const names = Object.keys(cameras).sort();
  const connected = names.filter((name) => cameras[name].connected).length;
  const known = names.some((name) => cameras[name].state !== "unknown");
  setText(byId("cameras-count"), known ? t("cameras.connected", { connected, n: names.length }) : "");
  const clicked = (name) => (recording ? undefined : local.devices.find((one) => one.camera === name && one.state === "connected"));
  const key = names.map((name) => {
    const camera = cameras[name];
    return [name, health(camera), figures(camera), remarks(camera), camera.reference, camera.reason, colours[name], preview(name, camera), clicked(name)?.id];
  });
  redraw(byId("cameras"), names.length ? key : [local.devices, addressForOthers(), onlyHere()], () => (names.length
    ? h("ul", {}, names.map((name) => row(name, cameras[name], colours[name] ?? "var(--muted)", clicked(name))))
    : nobody(local.devices)));
  updateReference(cameras, recording);
  const shown = names.length > 0 && !recording;
  redraw(byId("cameras-more"), [shown, local], () => (shown ? below(local) : []));
}
