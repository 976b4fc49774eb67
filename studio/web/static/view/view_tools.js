// Over the 3D view: where this browser looks from, which layers are shown, which joints draw trails.
import { changeView } from "../base/api.js";
import { byId, h, redraw, setText } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { serverText, t } from "../base/strings.js";
import { bodyChoice, shownBody } from "./body.js";
import { pointsChoice, startPoints, updatePoints } from "./points.js";
import { startResolution } from "./resolution.js";
import { GOING, followOperator, lookFrom, startViewpoint, viewpoint } from "./viewpoint.js";

const PLACES = ["stage", "motion", "front", "side", "top", "orbit", "follow"];
const KEYS = { stage: "5", motion: "6", front: "1", side: "2", top: "3", orbit: "4", follow: "F" };
const TRAILS = [
  "Head", "Hips", "LeftHand", "RightHand", "LeftForeArm", "RightForeArm", "LeftLeg", "RightLeg", "LeftFoot", "RightFoot",
];

async function change(wanted) {
  const view = await attempt(() => changeView(wanted));
  if (view) updateView(view);
}

function place(name, chosen) {
  const words = t(`view.${name}`);
  return h("button", {
    type: "button", id: `view-${name}`, title: `${t(`view.${name}_hint`)} (${KEYS[name]})`, onclick: () => lookFrom(name),
    aria: { ...(GOING.includes(name) && { pressed: String(chosen === name) }), keyshortcuts: KEYS[name].toLowerCase() },
  }, words);
}

function layer(name, { label, shown }) {
  const words = serverText(`layer.${name}`, label);
  return h("label", { class: "layer", title: t(`layer_help.${name}`) },
    h("input", { id: `layer-${name}`, type: "checkbox", name, checked: shown, onchange: (event) => change({ layers: { [name]: event.target.checked } }) }),
    words);
}

function trail(name, chosen) {
  const toggle = () => change({ trails: chosen.includes(name) ? chosen.filter((one) => one !== name) : [...chosen, name], layers: { trails: true } });
  return h("button", { type: "button", id: `trail-${name}`, class: "chip-button", onclick: toggle, aria: { pressed: String(chosen.includes(name)) } },
    t(`joint.${name}`));
}

const trails = (chosen) => h("div", { class: "trails", role: "group", aria: { label: t("view.trails") } }, TRAILS.map((name) => trail(name, chosen)));

/** Show where this browser looks from, and whether it follows the operator's view; the operator's view itself follows no other. */
function updateViewpoint() {
  const { place: chosen, following, source, known, operator } = viewpoint();
  redraw(byId("view-places"), [chosen], () => PLACES.map((name) => place(name, chosen)));
  const button = byId("view-operator"), key = following ? "view.own" : "view.operator";
  button.hidden = source || !known;
  button.disabled = !operator && !following;
  setText(button, t(key));
  button.title = t(operator || following ? `${key}_hint` : "view.no_operator");
}

/** Show what all browsers' views share (layers and trails) and this browser's body. */
export function updateView(view) {
  updatePoints(view);
  redraw(byId("layers"), [view.layers, view.trails, view.points, view.colours, view.robots, view.robot, view.robot_strained, view.robot_gave_way, shownBody()], () => [
    h("legend", {}, t("stage.layers")),
    ...Object.entries(view.layers).flatMap(([name, one]) => [
      layer(name, one), name === "character" && one.shown && bodyChoice(view, () => updateView(view), change), name === "trails" && one.shown && trails(view.trails), name === "points" && one.shown && pointsChoice(view, change),
    ]),
  ].filter(Boolean));
}

/** Start; the menu of layers closes when something else is clicked, or Escape is pressed. */
export function startViewTools() {
  startViewpoint(updateViewpoint);
  byId("view-operator").addEventListener("click", () => followOperator(!viewpoint().following));
  startPoints();
  startResolution();
  const menu = byId("view-layers");
  document.addEventListener("pointerdown", (event) => { if (!menu.contains(event.target)) menu.open = false; });
  window.addEventListener("blur", () => {
    if (document.activeElement === byId("viewer")) menu.open = false; // a click into the 3D view
  });
  menu.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || !menu.open) return;
    event.stopPropagation();
    menu.open = false;
    menu.querySelector("summary").focus();
  });
}
