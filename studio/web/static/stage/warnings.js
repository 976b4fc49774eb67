// What the operator must learn at once: a performer who leaves the view, a camera that is silent or limited.
import { byId, setText } from "../base/dom.js";
import { isMuted, play, setMuted } from "../base/sound.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";

let shown = "";

/** What is wrong while a take is recorded, in words; empty where nothing is. */
function wordsOf(cameras) {
  const gone = cameras.filter(([, camera]) => !camera.connected || camera.state === "silent").map(([name]) => name);
  if (gone.length) return t("warning.silent", { names: gone.join(", "), n: gone.length });
  const blind = cameras.filter(([, camera]) => camera.limited_by === "no_performer").map(([name]) => name);
  if (cameras.length && blind.length === cameras.length) return t("warning.nobody");
  const limited = cameras.filter(([, camera]) => camera.limited_by && camera.limited_by !== "no_performer");
  if (limited.length) return limited.map(([name, camera]) => `${name}: ${t(`camera.limited_by.${camera.limited_by}`)}`).join(" · ");
  if (blind.length) return t("warning.not_seen", { names: blind.join(", "), n: blind.length });
  return "";
}

/** Show and sound what is wrong with a recording under way. */
export function updateWarnings(status) {
  const all = [wordsOf(Object.entries(status.cameras).sort()), ...status.performer_warnings.map(said)].filter(Boolean).join(" · ");
  const words = status.recording.active && !status.stale ? all : "";
  const place = byId("warning");
  place.hidden = !words;
  if (words) setText(place, words);
  if (words && words !== shown) play("refusal");
  shown = words;
}

function showSound() {
  byId("sound").setAttribute("aria-pressed", String(!isMuted()));
  byId("sound").title = t(isMuted() ? "sound.on" : "sound.off");
}

/** Connect the sound switch. */
export function startWarnings() {
  byId("sound").addEventListener("click", () => {
    setMuted(!isMuted());
    showSound();
    play("tick");
  });
  showSound();
}
