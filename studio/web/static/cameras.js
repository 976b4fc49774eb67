// The cameras panel: name, colour, frame rate, latency and health in words.
import { byId, h, plural, redraw, setText } from "./dom.js";

const HEALTH = {
  live: ["Good", "good"],
  trouble: ["Trouble", "fair"],
  silent: ["No frames", "bad"],
  gone: ["Disconnected", "bad"],
};

function health(camera) {
  if (camera.state === "live" && camera.fps < 20) return ["Slow", "fair"];
  if (camera.state === "live" && !camera.calibrated) return ["Not calibrated", "fair"];
  return HEALTH[camera.state] ?? [camera.state, "muted"];
}

function figures(camera) {
  const parts = [`${camera.fps.toFixed(0)} fps`];
  if (camera.latency_ms !== null) parts.push(`${camera.latency_ms.toFixed(0)} ms`);
  if (camera.jitter_ms !== null) parts.push(`±${camera.jitter_ms.toFixed(1)} ms`);
  if (camera.reference) parts.push("reference");
  return parts.join("  ·  ");
}

function row(name, camera, colour) {
  const [words, tone] = health(camera);
  return h("li", { class: "camera" },
    h("span", { class: "swatch", style: `background:${colour}`, aria: { hidden: "true" } }),
    h("span", { class: "name", title: camera.device }, name),
    h("span", { class: `health ${tone}` }, words),
    camera.connected && h("span", { class: "figures", title: "Frame rate, delay from capture to arrival, its spread" },
      figures(camera)),
    camera.reason && h("span", { class: "words" }, camera.reason));
}

function nobody() {
  const command = `studio camera --source SOURCE --server ${location.origin}`;
  const copy = h("button", { class: "small", type: "button", onclick: () => navigator.clipboard.writeText(command) }, "Copy");
  return [
    h("p", { class: "empty" }, "No camera is connected. Start one on any machine that reaches this server:"),
    h("p", { class: "copy" }, h("code", {}, command), copy),
  ];
}

/** Show the cameras of a status (by name) in their colours. */
export function updateCameras(cameras, colours) {
  const names = Object.keys(cameras).sort();
  const connected = names.filter((name) => cameras[name].connected).length;
  setText(byId("cameras-count"), names.length ? `${connected} of ${plural(names.length, "camera")} connected` : "");
  const key = names.map((name) => [name, health(cameras[name]), figures(cameras[name]), cameras[name].reason, colours[name]]);
  redraw(byId("cameras"), key, () => names.length
    ? h("ul", {}, names.map((name) => row(name, cameras[name], colours[name] ?? "var(--muted)")))
    : nobody());
}
