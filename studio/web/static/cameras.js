// The cameras panel: name, colour, frame rate, latency and health in words.
import { chooseReference } from "./api.js";
import { byId, h, redraw, setText } from "./dom.js";
import { attempt } from "./messages.js";
import { number, t } from "./strings.js";

const KEPT_SHOWN = 60; // a second of two cameras is always on its way

const TONES = { live: "good", trouble: "fair", silent: "bad", gone: "bad" };

function health(camera) {
  const going = camera.state === "live" || camera.state === "trouble";
  if (going && camera.starved) return [t(`camera.starved.${camera.starved}`), "fair"];
  if (camera.state === "live" && !camera.calibrated) return [t("camera.not_calibrated"), "fair"];
  return [t(`camera.state.${camera.state}`), TONES[camera.state] ?? "muted"];
}

function figures(camera) {
  const parts = [t("camera.fps", { fps: number(camera.fps) })];
  if (camera.latency_ms !== null) parts.push(`${camera.latency_ms.toFixed(0)} ms`);
  if (camera.jitter_ms !== null) parts.push(`±${number(camera.jitter_ms, 1)} ms`);
  if (camera.loss_percent) parts.push(t("camera.lost", { percent: number(camera.loss_percent) }));
  if (camera.reference) parts.push(t("camera.reference"));
  return parts.join("  ·  ");
}

const signed = (value, digits) => `${value < 0 ? "−" : "+"}${number(Math.abs(value), digits)}`;

/** How the camera's clock stands to the stage clock, and what the client keeps for the server. */
function details(camera) {
  const { offset_ms: offset, drift_ppm: drift, error_ms: error, jumps } = camera.clock;
  const parts = [];
  if (offset !== null && !camera.reference) {
    const far = Math.abs(offset) < 1e5 ? `${signed(offset, 1)} ms` : `${signed(offset / 1000, 0)} s`;
    parts.push(t("camera.clock", { offset: far }), `${signed(drift, 0)} ppm`);
  }
  if (error !== null) parts.push(t("camera.in_step", { ms: number(error, 1) }));
  if (jumps) parts.push(t("camera.jumps", { n: jumps }));
  if (camera.kept_by_client > KEPT_SHOWN) parts.push(t("camera.kept", { n: camera.kept_by_client }));
  if (camera.unknown_by_client) parts.push(t("camera.unknown", { n: camera.unknown_by_client }));
  if (camera.not_kept_by_client) parts.push(t("camera.not_kept", { n: camera.not_kept_by_client }));
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
    camera.connected && h("span", { class: "figures", title: t("camera.figures_hint") },
      figures(camera)),
    camera.connected && details(camera) && h("span", { class: "words", title: t("camera.clock_hint") },
      details(camera)),
    camera.reason && h("span", { class: "words" }, camera.reason),
    camera.connected && camera.previews > 0 && h("img", { class: "preview", src: preview(name, camera), alt: t("camera.sees", { name }) }));
}

/** A choice of the camera whose clock is the stage clock; apart from the list, which is drawn anew all the time. */
function reference(names, now) {
  const select = h("select", {
    id: "reference", title: t("camera.reference_hint"),
    onchange: () => attempt(() => chooseReference(select.value)),
  }, names.map((name) => h("option", { value: name, selected: name === now }, name)));
  return h("label", { class: "field reference" }, h("span", {}, t("camera.reference_label")), select);
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
  const copy = h("button", { class: "small", type: "button", onclick: () => navigator.clipboard.writeText(command) }, t("message.copy"));
  return [
    h("p", { class: "empty" }, t("cameras.none")),
    h("p", { class: "copy" }, h("code", {}, command), copy),
  ];
}

/** Show the cameras of a status (by name) in their colours; the reference is chosen only while nothing is recorded. */
export function updateCameras(cameras, colours, recording) {
  const names = Object.keys(cameras).sort();
  const connected = names.filter((name) => cameras[name].connected).length;
  setText(byId("cameras-count"), names.length ? t("cameras.connected", { connected, n: names.length }) : "");
  const key = names.map((name) => {
    const camera = cameras[name];
    return [name, health(camera), figures(camera), details(camera), camera.reason, colours[name], preview(name, camera)];
  });
  redraw(byId("cameras"), key, () => names.length
    ? h("ul", {}, names.map((name) => row(name, cameras[name], colours[name] ?? "var(--muted)")))
    : nobody());
  updateReference(cameras, recording);
}
