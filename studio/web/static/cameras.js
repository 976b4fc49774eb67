// The cameras panel: name, colour, frame rate, latency and health in words.
import { chooseReference } from "./api.js";
import { byId, h, plural, redraw, setText } from "./dom.js";
import { attempt } from "./messages.js";

const KEPT_SHOWN = 60; // a second of two cameras is always on its way

const HEALTH = {
  live: ["Good", "good"],
  trouble: ["Trouble", "fair"],
  silent: ["No frames", "bad"],
  gone: ["Disconnected", "bad"],
};

const STARVED = {
  no_frames: "Slow",
  network: "Slow network",
  usb: "Shared USB?",
  clock: "Wrong clock",
  no_performer: "Sees nobody",
  moved: "Moved?",
};

function health(camera) {
  if (camera.state === "live" && camera.starved) return [STARVED[camera.starved] ?? "Starved", "fair"];
  if (camera.state === "trouble" && camera.starved) return [STARVED[camera.starved] ?? "Trouble", "fair"];
  if (camera.state === "live" && !camera.calibrated) return ["Not calibrated", "fair"];
  return HEALTH[camera.state] ?? [camera.state, "muted"];
}

function figures(camera) {
  const parts = [`${camera.fps.toFixed(0)} fps`];
  if (camera.latency_ms !== null) parts.push(`${camera.latency_ms.toFixed(0)} ms`);
  if (camera.jitter_ms !== null) parts.push(`±${camera.jitter_ms.toFixed(1)} ms`);
  if (camera.loss_percent) parts.push(`${camera.loss_percent.toFixed(0)} % lost`);
  if (camera.reference) parts.push("reference");
  return parts.join("  ·  ");
}

const signed = (number, digits) => `${number < 0 ? "−" : "+"}${Math.abs(number).toFixed(digits)}`;

/** How the camera's clock stands to the stage clock, and what the client keeps for the server. */
function details(camera) {
  const { offset_ms: offset, drift_ppm: drift, error_ms: error, jumps } = camera.clock;
  const parts = [];
  if (offset !== null && !camera.reference) {
    parts.push(`clock ${Math.abs(offset) < 1e5 ? `${signed(offset, 1)} ms` : `${signed(offset / 1000, 0)} s`}`, `${signed(drift, 0)} ppm`);
  }
  if (error !== null) parts.push(`in step within ${error.toFixed(1)} ms`);
  if (jumps) parts.push(`its clock jumped ${plural(jumps, "time")}`);
  if (camera.kept_by_client > KEPT_SHOWN) parts.push(`${camera.kept_by_client} frames to come`);
  if (camera.unknown_by_client) parts.push(`${camera.unknown_by_client} frames of takes that are not here stay with the client`);
  if (camera.not_kept_by_client) parts.push(`${camera.not_kept_by_client} frames not kept: the client's spool is full`);
  return parts.join("  ·  ");
}

/** A number that changes every other second, so that the picture is fetched anew. */
const preview = (name, camera) => `/api/v1/cameras/${encodeURIComponent(name)}/preview?n=${Math.floor(camera.previews / 10)}`;

function row(name, camera, colour) {
  const [words, tone] = health(camera);
  return h("li", { class: "camera" },
    h("span", { class: "swatch", style: `background:${colour}`, aria: { hidden: "true" } }),
    h("span", { class: "name", title: camera.device }, name),
    h("span", { class: `health ${tone}` }, words),
    camera.connected && h("span", { class: "figures", title: "Frame rate, delay from capture to arrival, its spread, frames that did not come" },
      figures(camera)),
    camera.connected && details(camera) && h("span", { class: "words", title: "Offset and drift to the stage clock, and how exactly they are known" },
      details(camera)),
    camera.reason && h("span", { class: "words" }, camera.reason),
    camera.connected && camera.previews > 0 && h("img", { class: "preview", src: preview(name, camera), alt: `What ${name} sees` }));
}

/** A choice of the camera whose clock is the stage clock; apart from the list, which is drawn anew all the time. */
function reference(names, now) {
  const select = h("select", {
    id: "reference", title: "The camera whose clock is the stage clock",
    onchange: () => attempt(() => chooseReference(select.value)),
  }, names.map((name) => h("option", { value: name, selected: name === now }, name)));
  return h("label", { class: "field reference" }, h("span", {}, "Reference"), select);
}

function updateReference(cameras, recording) {
  if (!byId("cameras-reference")) byId("cameras").insertAdjacentElement("afterend", h("div", { id: "cameras-reference" }));
  const names = Object.keys(cameras).sort().filter((name) => cameras[name].connected);
  const now = names.find((name) => cameras[name].reference) ?? "";
  const shown = names.length > 1 && !recording;
  redraw(byId("cameras-reference"), [names, now, shown], () => (shown ? reference(names, now) : []));
}

function nobody() {
  const command = `studio camera --source SOURCE --server ${location.origin}`;
  const copy = h("button", { class: "small", type: "button", onclick: () => navigator.clipboard.writeText(command) }, "Copy");
  return [
    h("p", { class: "empty" }, "No camera is connected. Start one on any machine that reaches this server:"),
    h("p", { class: "copy" }, h("code", {}, command), copy),
  ];
}

/** Show the cameras of a status (by name) in their colours; the reference is chosen only while nothing is recorded. */
export function updateCameras(cameras, colours, recording) {
  const names = Object.keys(cameras).sort();
  const connected = names.filter((name) => cameras[name].connected).length;
  setText(byId("cameras-count"), names.length ? `${connected} of ${plural(names.length, "camera")} connected` : "");
  const key = names.map((name) => {
    const camera = cameras[name];
    return [name, health(camera), figures(camera), details(camera), camera.reason, colours[name], preview(name, camera)];
  });
  redraw(byId("cameras"), key, () => names.length
    ? h("ul", {}, names.map((name) => row(name, cameras[name], colours[name] ?? "var(--muted)")))
    : nobody());
  updateReference(cameras, recording);
}
