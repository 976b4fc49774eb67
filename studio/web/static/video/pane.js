// The video of a camera next to the replay, on the replay's clock: it shows the picture of the current frame, or reports that
// this picture has not arrived yet.
import { byId, h, redraw, setText } from "../base/dom.js";
import { getVideo, getVideoDrawn, getVideos, videoPicture } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { hear, said } from "../base/said.js";
import { t } from "../base/strings.js";
import { colourOf, drawPicture } from "./drawing.js";
import { Pictures } from "./pictures.js";

const AHEAD = 60; // frames of the replay
const PART = 240; // pictures whose drawings come at once
const WIDTHS = [320, 480, 640, 960, 1280, 1920];
const KINDS = ["landmarks", "skeleton"];
const LATE_MS = 400; // a picture may be missing for so long before it is said

const state = {
  shown: sessionStorage.getItem("video") === "on", camera: sessionStorage.getItem("video-camera") ?? "",
  on: Object.fromEntries(KINDS.map((kind) => [kind, localStorage.getItem(`video-${kind}`) !== "off"])),
  wanted: "", replay: { open: false }, frame: 0, list: null, video: null, places: new Map(), parts: new Map(), pictures: null, painted: null, width: 0, missing: 0, said: "",
};

/** Whether the pane is open. */
export const videoShown = () => state.shown;

/** Open the pane, or close it. */
export function toggleVideo() {
  state.shown = !state.shown;
  sessionStorage.setItem("video", state.shown ? "on" : "off");
  followVideo(state.replay);
}

/** The shown picture: `{camera, number, frame, place, joints, names}`, with the solved skeleton's places in it and its joints' names; null without one. */
export const shownPicture = () => (byId("video").hidden ? null : state.painted);

/** Draw the picture again. */
export const repaintVideo = () => paintVideo(state.frame);

/** Forget what is drawn: a new solve may have the same name. */
export function forgetVideo() {
  state.wanted = "";
}

function clear() {
  state.pictures?.close();
  Object.assign(state, { video: null, pictures: null, places: new Map(), parts: new Map(), said: "" });
}

/** Update to what is replayed. */
export function followVideo(replay) {
  state.replay = replay;
  const pane = byId("video"), shown = replay.open && state.shown;
  pane.hidden = !shown;
  if (!shown) {
    if (!replay.open || state.pictures) clear();
    state.wanted = "";
    return;
  }
  const wanted = JSON.stringify([replay.take, replay.solve, replay.frames]);
  if (wanted !== state.wanted) load(wanted);
  showHead();
}

async function load(wanted) {
  state.wanted = wanted;
  const list = await attempt(getVideos, () => state.wanted === wanted);
  if (!list || state.wanted !== wanted || list.take !== state.replay.take) return;
  state.list = list;
  const names = list.cameras.map(({ name }) => name);
  if (!names.includes(state.camera)) state.camera = (list.cameras.find(({ why }) => !why) ?? list.cameras[0])?.name ?? "";
  await loadCamera(wanted);
}

async function loadCamera(wanted) {
  const { camera, list } = state;
  clear();
  const why = list.cameras.length ? list.cameras.find(({ name }) => name === camera).why : t("video.no_camera");
  state.said = why ? said(why) : t("video.loading");
  showHead();
  repaintVideo();
  if (why) return;
  const video = await attempt(() => getVideo(camera), () => state.wanted === wanted);
  if (!video || state.wanted !== wanted || state.camera !== camera) return;
  state.video = video;
  state.places = new Map(video.order.map((number, place) => [number, place]));
  state.said = "";
  openPictures();
  showHead();
  repaintVideo();
}

function openPictures() {
  state.pictures?.close();
  const { take } = state.replay, { camera, list: { stamp } } = state;
  state.width = widthWanted();
  const { width } = state;
  state.pictures = new Pictures((number) => videoPicture(take, camera, number, width, stamp), repaintVideo, (number, error) => {
    if (number === state.video?.pictures[state.frame]) showSaid(said(hear(error)?.message) ?? t("video.broken"));
  });
}

function widthWanted() {
  const pixels = byId("video-canvas").clientWidth * (window.devicePixelRatio || 1);
  return WIDTHS.find((width) => width >= pixels) ?? WIDTHS.at(-1);
}

function chooseCamera(name) {
  state.camera = name;
  sessionStorage.setItem("video-camera", name);
  loadCamera(state.wanted);
}

function turn(kind, on) {
  state.on[kind] = on;
  localStorage.setItem(`video-${kind}`, on ? "on" : "off");
  repaintVideo();
}

function box(kind) {
  const why = state.video?.[`no_${kind}`] ?? "";
  return h("label", { class: "video-kind", title: why ? said(why) : t(`video.${kind}_hint`) },
    h("input", { type: "checkbox", id: `video-${kind}`, checked: state.on[kind] && !why, disabled: Boolean(why), onchange: (event) => turn(kind, event.currentTarget.checked) }),
    h("span", { class: "video-swatch", style: `background: ${colourOf(kind)}`, aria: { hidden: "true" } }), t(`video.${kind}`));
}

function showHead() {
  const cameras = state.list?.cameras ?? [];
  redraw(byId("video-head"), [cameras, state.camera, state.video?.camera, KINDS.map((kind) => state.video?.[`no_${kind}`])], () => [
    h("select", { id: "video-camera", title: t("video.camera"), aria: { label: t("video.camera") }, onchange: (event) => chooseCamera(event.currentTarget.value) },
      cameras.map(({ name, why }) => h("option", { value: name, selected: name === state.camera }, why ? t("video.without", { name }) : name))),
    ...KINDS.map(box),
    h("span", { class: "spacer" }),
    h("button", { id: "video-close", type: "button", class: "small square quiet", title: `${t("video.close")} (V)`, aria: { label: t("video.close") }, onclick: toggleVideo }, "×")]);
}

/** Request the pictures that are shown next, in order; during playback, not those that would arrive too late. */
function wantAhead(frame) {
  const { playing, first, last, loop, speed, rate_hz: rate } = state.replay, { pictures } = state.video;
  const skipped = playing ? Math.round(state.pictures.latency_s * speed * rate) : 0, numbers = new Set();
  let late = 0;
  for (let ahead = 0; ahead < skipped + AHEAD; ahead += 1) {
    if (ahead === skipped) late = numbers.size;
    let next = frame + ahead;
    if (next > last) {
      if (!loop || !playing) break;
      next = first + ((next - first) % (last - first + 1));
    }
    if (pictures[next] >= 0) numbers.add(pictures[next]);
  }
  state.pictures.want([...numbers], late);
}

async function loadPart(part) {
  if (state.parts.has(part)) return;
  const { parts, camera } = state;
  parts.set(part, null);
  const found = await attempt(() => getVideoDrawn(camera, part * PART, (part + 1) * PART - 1));
  if (state.parts !== parts || !found) return;
  parts.set(part, found);
  repaintVideo();
}

function figuresOf(number) {
  const place = state.places.get(number), part = Math.floor(place / PART), { video } = state;
  if (KINDS.every((kind) => video[`no_${kind}`] || !state.on[kind])) return {};
  loadPart(part);
  if (state.replay.playing && place % PART > PART / 2 && (part + 1) * PART < video.order.length) loadPart(part + 1);
  const drawn = state.parts.get(part), bones = { landmarks: video.bones, skeleton: video.skeleton_bones };
  if (!drawn) return {};
  return Object.fromEntries(KINDS.filter((kind) => state.on[kind] && !video[`no_${kind}`] && drawn[kind][place - drawn.first])
    .map((kind) => [kind, { joints: drawn[kind][place - drawn.first], bones: bones[kind] }]));
}

/** Draw the picture of a frame; until it arrives the last one stays, and a delay is reported. */
export function paintVideo(frame) {
  state.frame = frame;
  state.painted = null;
  if (byId("video").hidden) return;
  const canvas = byId("video-canvas"), { video, pictures } = state;
  if (!video || !pictures) {
    drawPicture(canvas, null, {});
    delete canvas.dataset.picture;
    showSaid(state.said);
    return;
  }
  if (widthWanted() > state.width) openPictures();
  const number = video.pictures[frame] ?? -1, found = number < 0 ? null : state.pictures.near(number, state.replay.playing ? 1 : 0);
  if (number < 0) {
    drawPicture(canvas, null, {});
    delete canvas.dataset.picture;
    showSaid(t("video.no_picture"));
  } else if (found) {
    const figures = figuresOf(found[0]), place = drawPicture(canvas, found[1], figures);
    if (figures.skeleton) state.painted = { camera: video.camera, number: found[0], frame, place, joints: figures.skeleton.joints, names: video.skeleton_joints };
    Object.assign(canvas.dataset, { picture: found[0], frame, place: JSON.stringify(place) });
    state.missing = 0;
    showSaid("");
  } else {
    state.missing ||= performance.now();
    if (!pictures.broken.has(number) && performance.now() - state.missing > LATE_MS) showSaid(t("video.behind"));
  }
  wantAhead(frame); // which lets go of those that are no longer needed
}

function showSaid(words) {
  const line = byId("video-said");
  setText(line, words);
  line.hidden = !words;
}

/** Begin. */
export function startVideo() {
  new ResizeObserver(repaintVideo).observe(byId("video"));
  window.addEventListener("language", () => { if (state.list) followVideo(state.replay); });
}
