// What the operator must hear of at once: a performer who leaves the view, a camera that starves.
import { byId, setText } from "./dom.js";
import { t } from "./strings.js";

const KEPT = "sound";
const WARN_HZ = 330;
const state = { shown: "", audio: null };

export const soundOn = () => localStorage.getItem(KEPT) === "on";

/** Sound a tone of so many hertz and seconds, where sound is on. */
export function beep(hertz, seconds) {
  if (!soundOn()) return;
  state.audio ??= new AudioContext();
  const tone = state.audio.createOscillator(), gain = state.audio.createGain();
  tone.frequency.value = hertz;
  gain.gain.setValueAtTime(0.15, state.audio.currentTime);
  gain.gain.exponentialRampToValueAtTime(0.001, state.audio.currentTime + seconds);
  tone.connect(gain).connect(state.audio.destination);
  tone.start();
  tone.stop(state.audio.currentTime + seconds);
}

/** What is wrong while a take is recorded, in words; empty where nothing is. */
function wordsOf(cameras) {
  const gone = cameras.filter(([, camera]) => !camera.connected || camera.state === "silent").map(([name]) => name);
  if (gone.length) return t("warning.silent", { names: gone.join(", "), n: gone.length });
  const blind = cameras.filter(([, camera]) => camera.starved === "no_performer").map(([name]) => name);
  if (cameras.length && blind.length === cameras.length) return t("warning.nobody");
  const starved = cameras.filter(([, camera]) => camera.starved && camera.starved !== "no_performer").map(([name]) => name);
  if (starved.length) return t("warning.starved", { names: starved.join(", "), n: starved.length });
  if (blind.length) return t("warning.not_seen", { names: blind.join(", "), n: blind.length });
  return "";
}

/** Show, and sound where sound is on, what is wrong with a recording under way. */
export function updateWarnings(status) {
  const words = status.recording.active ? wordsOf(Object.entries(status.cameras).sort()) : "";
  const place = byId("warning");
  place.hidden = !words;
  if (words) setText(place, words);
  if (words && words !== state.shown) beep(WARN_HZ, 0.6);
  state.shown = words;
}

function showSound() {
  byId("sound").setAttribute("aria-pressed", String(soundOn()));
  byId("sound").title = t(soundOn() ? "sound.off" : "sound.on");
}

/** Connect the switch of sounds. */
export function startWarnings() {
  byId("sound").addEventListener("click", () => {
    localStorage.setItem(KEPT, soundOn() ? "off" : "on");
    showSound();
    beep(WARN_HZ, 0.2);
  });
  showSound();
}
