// A phone as a camera: its picture with the skeleton in it, advice on placing it, and its link to the studio.
import { byId, h, setText } from "../base/dom.js";
import { startFrame } from "../base/frame.js";
import { hasText, number, t, template } from "../base/strings.js";
import { NoCamera, PictureClock, exposureOf, followBattery, isSelfie, isWide, keepAwake, lensOf, listCameras, openCamera } from "./camera.js";
import { draw } from "./drawing.js";
import { advice, brightnessOf, isDark } from "./framing.js";
import { Held } from "./held.js";
import { Link } from "./link.js";
import { landmarkMessage, unmirrored } from "./message.js";
import { pack } from "./msgpack.js";
import { Ended, Pose, canFind } from "./pose.js";
import { enter, forgetEntry, isName, known } from "./entry.js";
import { Footage } from "./video/footage.js";
import { Spool } from "./spool.js";
import { Watch } from "./watch.js";

const KEEP_VIDEO = "phone-keep-video";
const NO_VIDEO = ["full", "codec", "database"]; // why a video is not recorded
const LOOK_MS = 1000;
const EXPOSED = 1.5; // times as much or as little light as before: told
const SLOW_FPS = 10;
const SAME_NS = 1_000_000; // two pictures so near to each other are one
const SKIPPED = 0.1; // pictures left out for each that was looked at: with more, this phone is as busy as it can be

const video = byId("video"), overlay = byId("overlay"), small = h("canvas", { width: 32, height: 32 });
const now = {
  running: false, found: null, brightness: null, lens: null, exposure: null, size: null, shown: 0, sequence: 0, last: 0, seen: 0,
  fps: null, sent: 0, skipped: 0, looked: 0, busyMs: 0, load: 0,
};
let link = null, footage = null, pictures = null, stream = null, busy = false, letSleep = null, looking = null, opening = false;

const watch = new Watch(() => link?.sendStatus());
const held = new Held((degrees) => watch.pass("moved", { degrees: Math.round(degrees) }));
const pose = new Pose(showFigures);

/** Content of the status message: what the operator should know, and how busy this phone is [%]. */
function status() {
  const [what, values] = watch.worst ?? ["", {}];
  const words = what && template(`phone_says.${what}`, true).replace(/\{(\w+)\}/g, (_, name) => values[name]);
  return {
    processor_percent: now.load, sending_percent: 0,
    message: words, message_code: what && `phone_says.${what}`, message_values: values,
  };
}

function showLink(state, detail) {
  document.body.dataset.connection = state === "refused" ? "gone" : state;
  setText(byId("link-state"), t(`phone_camera.link.${state}`));
  if (state !== "refused") return;
  if (detail.code === "token") forgetEntry();
  stop(hasText(`phone_camera.refused.${detail.code}`) ? t(`phone_camera.refused.${detail.code}`) : detail.reason);
}

function showFigures() {
  if (!now.size || !pose.model) return;
  const [width, height] = now.size;
  setText(byId("figures"), t("phone_camera.figures", { fps: now.fps === null ? "–" : number(now.fps), width, height, model: pose.model, ms: pose.ms === null ? "–" : number(pose.ms) }));
}

function showAdvice() {
  const { key, values, tone } = advice({ found: now.found, brightness: now.brightness, held: held.now, wide: isWide(track()) });
  byId("advice").dataset.tone = tone;
  setText(byId("advice"), t(key, values));
}

const track = () => stream.getVideoTracks()[0];

/** Take a camera frame and send what is found in it. */
async function take(begin, frame) {
  if (!now.running) return;
  video.requestVideoFrameCallback(take);
  const { picture, time_ns: at_ns } = pictures.taken(video, begin, frame);
  if (Math.abs(at_ns - now.seen) < SAME_NS) return void picture?.close(); // a busy page had it already
  now.seen = at_ns;
  footage.frame(picture, at_ns, { wanted: byId("keep-video").checked, sequence: now.sequence, mirrored: byId("mirrored").checked, rate: track().getSettings().frameRate || 30,
    width: video.videoWidth, height: video.videoHeight });
  picture?.close();
  if (busy) now.skipped += 1; // the newest picture, always: what came meanwhile is left out
  if (busy || !pose.thread || document.hidden) return;
  busy = true;
  try {
    const time_ns = Math.max(now.last + 1, at_ns);
    const raw = await pose.find(video, begin);
    if (!now.running) return;
    const found = byId("mirrored").checked ? unmirrored(raw) : raw;
    now.last = time_ns;
    link.frame(now.sequence, pack(landmarkMessage(now.sequence, time_ns, found)));
    now.sequence += 1;
    now.sent += 1;
    see(raw);
    document.body.dataset.frames = String(now.sequence);
  } catch (error) {
    if (now.running && !(error instanceof Ended)) stop(t("phone_camera.no.model", { detail: error.message }));
  } finally {
    busy = false;
  }
}

/** Show what was found, and note what changed. */
function see(found) {
  draw(overlay, found);
  found.picture.close();
  const size = [found.width, found.height];
  if (now.size && now.size.join() !== size.join()) watch.pass("rotated", { width: size[0], height: size[1] });
  Object.assign(now, { found, size });
  watch.set("two_people", found.people > 1, { people: found.people });
}

/** Update light, lens, figures and advice, once a second. */
function look() {
  const time = performance.now(), passed = (time - now.looked) / 1000;
  if (now.looked && passed > 0.5) {
    now.fps = now.sent / passed;
    now.load = now.skipped > SKIPPED * now.sent ? 100 : Math.min(100, Math.round((pose.busyMs - now.busyMs) / (10 * passed)));
  }
  watch.set("slow", now.fps !== null && now.fps < SLOW_FPS && !document.hidden && Boolean(now.found), { fps: Math.round(now.fps ?? 0) });
  if (!document.hidden && track().readyState === "ended") reopen();
  if (!document.hidden && video.videoWidth) {
    now.brightness = brightnessOf(video, small);
    const lens = lensOf(track()), exposure = exposureOf(track());
    if (now.lens && lens !== now.lens) watch.pass("lens");
    const ratio = exposure && now.exposure ? exposure / now.exposure : 1;
    if (ratio > EXPOSED || ratio < 1 / EXPOSED) watch.pass("exposure");
    Object.assign(now, { lens, exposure });
    showAdvice();
    watch.set("dark", isDark(now.brightness));
  }
  watch.set("no_space", link.keeper.spool.full);
  showFigures();
  showKept();
  showVideo(footage.recorder.problem);
  link.sendStatus();
  Object.assign(now, { sent: 0, skipped: 0, looked: time, busyMs: pose.busyMs });
}

function showKept() {
  const { recording, spool } = link.keeper;
  document.body.dataset.recording = String(recording);
  byId("recording").hidden = !recording;
  byId("kept").hidden = document.body.dataset.connection === "open" || !spool.owed;
  setText(byId("kept"), t("phone_camera.kept", { n: spool.owed }));
}

async function use(deviceId) {
  if (stream) for (const one of stream.getTracks()) one.stop();
  stream = await openCamera(deviceId);
  pictures = new PictureClock();
  video.srcObject = stream;
  await video.play();
  const selfie = isSelfie(track());
  for (const one of [video, overlay]) one.classList.toggle("selfie", selfie); // shown as in a mirror; what is found is not mirrored
  track().addEventListener("ended", () => watch.begin("interrupted"));
  track().addEventListener("mute", () => watch.begin("interrupted"));
  track().addEventListener("unmute", () => watch.end("interrupted"));
  watch.end("interrupted");
  await showLenses();
}

/** Reopen the camera that the phone took away, as for a call or while it slept; it may still be unavailable. */
async function reopen() {
  if (opening) return;
  opening = true;
  await use(byId("lens").value).catch(() => {});
  opening = false;
}

async function showLenses() {
  const cameras = await listCameras(), { deviceId } = track().getSettings();
  byId("lens").replaceChildren(...cameras.map((one, i) => h("option", { value: one.deviceId, selected: one.deviceId === deviceId }, one.label || t("phone_camera.lens_number", { n: i + 1 }))));
}

function showProblem(words) {
  byId("problem").hidden = !words;
  setText(byId("problem"), words);
}

/** Start: open the camera, enter the studio, connect the link, load the model. */
async function start() {
  const button = byId("start"), name = byId("name").value.trim();
  if (name && !isName(name)) return showProblem(t("phone_camera.no.name"));
  showProblem("");
  button.disabled = true;
  setText(button, t("phone_camera.starting"));
  try {
    if (!canFind()) throw new NoCamera("wasm");
    await held.start();
    await use(null);
    const entry = await enter(name);
    byId("name").value = entry.name;
    now.running = true;
    document.body.dataset.view = "camera";
    setText(byId("camera-name"), entry.name);
    await connect(entry);
    letSleep = keepAwake((on) => setText(byId("awake"), t(on ? "phone_camera.awake" : "phone_camera.asleep")));
    showAdvice();
    video.requestVideoFrameCallback(take);
    looking = setInterval(look, LOOK_MS);
    await pose.load(byId("model").value, byId("hands").checked).catch((error) => { throw new NoCamera("model", error.message); });
  } catch (error) {
    stop(error instanceof NoCamera ? t(`phone_camera.no.${error.why}`, { detail: error.message }) : error.message);
  } finally {
    button.disabled = false;
    setText(button, t("phone_camera.start"));
  }
}

async function connect({ name, token }) {
  const spool = new Spool();
  await spool.open();
  const hello = {
    type: "hello", protocol_version: 2, name, device: `phone: ${track().label}`.slice(0, 200), joint_set: "mediapipe", token,
    boot_id: crypto.randomUUID().replaceAll("-", ""), frames_per_second: track().getSettings().frameRate || 30,
  };
  link = new Link({ url: new URL("api/v1/link", location.href.replace(/^http/, "ws")).href, hello, spool, status, changed: showLink });
  footage = new Footage(link, token, showVideo);
  await footage.open();
  link.connect();
}

/** Show how many video parts are still on this phone, and what is wrong with the video. */
function showVideo(problem) {
  const { owed } = footage;
  const wrong = (byId("keep-video").checked || footage.asked) && problem;
  for (const one of NO_VIDEO) watch.set(`video_${one}`, wrong === one);
  byId("video-kept").hidden = !wrong && !owed && !footage.asked;
  setText(byId("video-kept"), wrong ? t(`phone_camera.no_video.${wrong}`) : owed ? t("phone_camera.video_kept", { n: owed }) : t("phone_camera.video_asked"));
}

/** Stop, and show why. */
function stop(words = "") {
  now.running = false;
  clearInterval(looking);
  letSleep?.();
  held.end();
  pose.end();
  pose.thread = null;
  link?.keeper.spool.write();
  footage?.end();
  link?.close();
  if (stream) for (const one of stream.getTracks()) one.stop();
  stream = null;
  Object.assign(now, { found: null, size: null, looked: 0, fps: null });
  byId("settings").close();
  document.body.dataset.view = "start";
  showProblem(words);
}

function hidden() {
  if (!link) return;
  watch.set("hidden", document.hidden);
  link.keeper.spool.write();
  footage?.write();
  if (!document.hidden) link.connect();
}

function showBattery({ percent, charging }) {
  setText(byId("battery"), t(charging ? "phone_camera.charging" : "phone_camera.battery", { percent }));
  byId("battery").dataset.tone = percent < 20 && !charging ? "bad" : "";
  byId("battery").hidden = false;
}

startFrame();
byId("name").value = known().name;
byId("keep-video").checked = localStorage.getItem(KEEP_VIDEO) === "yes";
byId("keep-video").addEventListener("change", (event) => localStorage.setItem(KEEP_VIDEO, event.currentTarget.checked ? "yes" : "no"));
byId("start").addEventListener("click", start);
byId("stop").addEventListener("click", () => stop());
byId("open-settings").addEventListener("click", () => byId("settings").showModal());
byId("lens").addEventListener("change", (event) => use(event.currentTarget.value).catch((error) => stop(t(`phone_camera.no.${error.why ?? "other"}`, { detail: error.message }))));
for (const id of ["model", "hands"]) {
  byId(id).addEventListener("change", () => pose.load(byId("model").value, byId("hands").checked).catch((error) => stop(t("phone_camera.no.model", { detail: error.message }))));
}
document.addEventListener("visibilitychange", hidden);
addEventListener("pagehide", () => { if (link && now.running) watch.begin("closed"); link?.keeper.spool.write(); footage?.write(); });
followBattery(showBattery);
if (!isSecureContext) showProblem(t("phone_camera.no.secure"));
else if (!canFind()) showProblem(t("phone_camera.no.wasm"));
