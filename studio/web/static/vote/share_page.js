// The replay page's controls. The page is one file without a server: the words are chosen by the browser's language.
import { Players } from "./players.js";
import texts from "../base/strings/takes/share.js";

const FRAME_S = 1 / 30;
const FRENCH = navigator.language.toLowerCase().startsWith("fr");
const ICONS = { play: "M8 5v14l11-7z", pause: "M7 5h4v14H7zM13 5h4v14h-4z" };
const byId = (id) => document.getElementById(id);
const t = (key) => texts[key][FRENCH ? 1 : 0];

function clock(seconds) {
  const hundredths = Math.round(seconds * 100);
  const minutes = Math.floor(hundredths / 6000);
  return `${minutes}:${String(Math.floor(hundredths / 100) % 60).padStart(2, "0")}.${String(hundredths % 100).padStart(2, "0")}`;
}

function name(id, key) {
  byId(id).title = t(key);
  byId(id).setAttribute("aria-label", t(key));
}

function press(id, on) {
  byId(id).setAttribute("aria-pressed", String(on));
}

function showPlaying(playing) {
  byId("play").querySelector("path").setAttribute("d", playing ? ICONS.pause : ICONS.play);
  name("play", playing ? "shared.pause" : "shared.play");
}

/** Return a listener that shows where the player is. */
function listener() {
  let shown = null;
  const begins = Number(document.body.dataset.begins); // a part counts on the clock of the whole performance
  return (share, playing, seconds, duration) => {
    const scrub = byId("scrub");
    if (document.activeElement !== scrub || playing) scrub.value = share;
    byId("time").textContent = `${clock(begins + seconds)} / ${clock(begins + duration)}`;
    if (shown === playing) return;
    shown = playing;
    showPlaying(playing);
  };
}

function connect(players) {
  const step = (frames) => players.seek((players.seconds + frames * FRAME_S) / players.duration);
  const loop = () => { players.loop = !players.loop; press("loop", players.loop); };
  const follow = () => { players.following = !players.following; press("follow", players.following); };
  byId("play").onclick = () => players.toggle();
  byId("back").onclick = () => step(-1);
  byId("on").onclick = () => step(1);
  byId("loop").onclick = loop;
  byId("follow").onclick = follow;
  byId("scrub").oninput = (event) => players.seek(Number(event.currentTarget.value));
  byId("speed").onchange = (event) => { players.speed = Number(event.currentTarget.value); };
  const keys = {
    " ": () => players.toggle(), l: loop, f: follow,
    ArrowLeft: (event) => step(event.shiftKey ? -10 : -1), ArrowRight: (event) => step(event.shiftKey ? 10 : 1),
    Home: () => players.seek(0), End: () => players.seek(1),
  };
  document.addEventListener("keydown", (event) => {
    const handle = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!handle || event.ctrlKey || event.metaKey || event.altKey || event.target.closest("select")) return;
    if (event.key === " " && event.target.closest("button:not(#play)")) return; // it presses what has the focus
    event.preventDefault();
    handle(event);
  });
}

function label() {
  document.documentElement.lang = FRENCH ? "fr" : "en";
  for (const id of ["back", "on", "time", "scrub", "speed"]) name(id, `shared.${id === "scrub" ? "time" : id}`);
  for (const id of ["loop", "follow"]) {
    byId(id).textContent = t(`shared.${id}`);
    byId(id).title = t(`shared.${id}_hint`);
  }
  byId("stage").setAttribute("aria-label", t("shared.stage"));
  showPlaying(true); // as it begins; the first picture may take a while
}

/** Start with the motion, a GLB file. */
export async function start(motion) {
  label();
  byId("words").textContent = t("shared.loading");
  const players = await Players.open([byId("stage")], [motion], listener());
  connect(players);
  byId("words").remove();
  document.body.dataset.ready = "";
}
