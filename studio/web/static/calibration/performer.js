// The performer panel: measure in a T-pose (T), or choose a performer measured earlier.
import { byId, h, redraw, setText } from "../base/dom.js";
import { cancelTPose, choosePerformer, getPerformers, startTPose } from "../base/api.js";
import { attempt, showNote } from "../base/messages.js";
import { canOperate } from "../base/role.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";
import { tallField, withoutDepth } from "./known.js";
import { startWizard } from "./wizard.js";

const BUSY = ["countdown", "holding", "computing"];
const panel = { profiles: [], state: "idle", name: "" };

const nameNow = () => byId("performer-name")?.value.trim() ?? "";

function measure() {
  if (BUSY.includes(panel.state)) attempt(cancelTPose);
  else attempt(() => startTPose(nameNow()));
}

async function loadProfiles() {
  panel.profiles = (await getPerformers()).map(({ name, height_m: height }) => ({ name, height }));
}

async function choose(event) {
  const name = event.currentTarget.value;
  if (!name) return;
  await attempt(() => choosePerformer(name));
  showNote(t("performer.working", { name }));
}

function build(busy, ready, flat) {
  const input = h("input", {
    id: "performer-name", type: "text", maxLength: 60, placeholder: t("performer.name"), value: panel.name, spellcheck: false,
    aria: { label: t("performer.name_label") }, title: t("performer.name_hint"),
    oninput: (event) => { panel.name = event.currentTarget.value; },
  });
  const button = h("button", {
    id: "tpose", type: "button", disabled: !ready, onclick: measure, aria: { keyshortcuts: "t" },
    title: t("performer.t_pose_hint"),
  }, t(busy ? "message.cancel" : "performer.t_pose"), h("kbd", {}, "T"));
  const known = h("select", { id: "performer-known", onchange: choose, aria: { label: t("performer.known_label") } },
    h("option", { value: "" }, t("performer.known")),
    panel.profiles.map(({ name, height }) => h("option", { value: name }, `${name}, ${number(height, 2)} m`)));
  return [flat && tallField("performer-tall"), h("div", { class: "pair" }, input, button), panel.profiles.length > 0 && known].filter(Boolean);
}

function words(tpose) {
  const { state, seconds_left: left, problems, message } = tpose;
  if (state === "countdown") return [t("performer.countdown", { seconds: Math.ceil(left) }), ...(problems.length ? [problems.map(said).join("; ")] : [])].join(": ");
  if (state === "holding") return problems.length ? problems.map(said).join("; ") : t("performer.hold", { seconds: Math.ceil(Math.max(left, 0)) });
  return state === "idle" ? "" : said(message);
}

/** Show the T-pose of a status; `ready`: whether a camera is connected. */
export function updatePerformer({ calibration, cameras, stale }, ready) {
  const { tpose } = calibration;
  const busy = BUSY.includes(tpose.state);
  if (tpose.state !== panel.state) {
    panel.state = tpose.state;
    if (tpose.state === "done") attempt(loadProfiles);
  }
  setText(byId("performer-height"), calibration.height_m ? t("performer.in_shoes", { m: number(calibration.height_m, 2) }) : "");
  const flat = withoutDepth(cameras).length > 0;
  redraw(byId("performer"), [busy, ready, flat, panel.profiles], () => build(busy, ready, flat));
  setText(byId("tpose-words"), stale ? "" : words(tpose));
  byId("tpose-words").className = `tpose ${busy ? "large" : ""} ${tpose.state === "failed" ? "bad" : ""}`;
}

/** Load the profiles, and listen for the T key. */
export function startPerformer() {
  attempt(loadProfiles);
  startWizard(nameNow);
  document.addEventListener("keydown", (event) => {
    const typing = event.target.closest("input, select, textarea, [contenteditable]");
    if (event.key.toLowerCase() !== "t" || typing || event.ctrlKey || event.metaKey || event.altKey || event.repeat) return;
    if (canOperate() && !byId("tpose")?.disabled) measure();
  });
}
