// The curves that the timeline's graphs show, a list to choose them from, and their legend. Each tab has its own choice.
import { byId, h, redraw, setText, svg } from "../base/dom.js";
import { hasText, plain, t } from "../base/strings.js";

const KEPT = "curves";
const COLOURS = 6; // then the same ones, dashed
const SHORT = { position: ["x", "y", "z"], rotation: ["x", "y", "z"], speed: [""], distance: [""] };
const FINGERS = ["Thumb", "Index", "Middle", "Ring", "Pinky"];
const COLUMN_KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/** Maximum number of curves. */
export const MOST = 12;

/** Channels of a joint, as the server names them. */
export const CHANNELS = Object.entries(SHORT).flatMap(([kind, axes]) => axes.map((axis) => (axis ? `${kind}_${axis}` : kind)));

const sided = (side) => ["Shoulder", "Arm", "ForeArm", "Hand", "UpLeg", "Leg", "Foot", "ToeBase"].map((name) => side + name);
const fingersOf = (side) => FINGERS.flatMap((finger) => [1, 2, 3].map((number) => `${side}Hand${finger}${number}`));
const ALL = ["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head", ...sided("Left"), ...sided("Right"), ...fingersOf("Left"), ...fingersOf("Right")];

const state = { list: JSON.parse(sessionStorage.getItem(KEPT) ?? "[]"), beside: false, changed: () => {} };

/** Return the chosen curves `{joint, channel, slot}`; the slot sets how each is drawn. Distances only with a second figure. */
export const chosenCurves = () => state.list.filter(({ channel }) => channel !== "distance" || state.beside);

/** Return the line style of a slot: a colour of the style sheet, and a dash pattern. */
export const styleOf = ({ slot }) => ({ colour: `--curve-${slot % COLOURS}`, dash: slot < COLOURS ? [] : [7, 4] });

/** Return a channel's name with its axis, as in other programs. */
export function channelWords(channel) {
  const [kind, axis = ""] = channel.split("_");
  return `${t(`channel.${kind}`)}${axis ? ` ${axis.toUpperCase()}` : ""}`;
}

const isChosen = (joint, channel) => state.list.some((one) => one.joint === joint && one.channel === channel);

function keep(list) {
  state.list = list;
  sessionStorage.setItem(KEPT, JSON.stringify(list));
  mark();
  state.changed();
}

function remove(joint, channel) {
  keep(state.list.filter((one) => one.joint !== joint || one.channel !== channel));
}

/** Return the curves with one more, if there is room. */
function withCurve(list, joint, channel) {
  const slots = new Set(list.map(({ slot }) => slot));
  let slot = 0;
  while (slots.has(slot)) slot += 1;
  return list.length < MOST ? [...list, { joint, channel, slot }] : list;
}

function toggle(joint, channel) {
  if (isChosen(joint, channel)) remove(joint, channel);
  else keep(withCurve(state.list, joint, channel));
}

/** Show the same channels of this joint as of other joints, or else its position; if it has curves already, remove them. */
export function changeCurvesOf(joint) {
  const others = state.list.filter((one) => one.joint !== joint);
  if (others.length < state.list.length) {
    keep(others);
    return;
  }
  const channels = CHANNELS.filter((channel) => others.some((one) => one.channel === channel));
  keep((channels.length ? channels : CHANNELS.slice(0, 3)).reduce((list, channel) => withCurve(list, joint, channel), others));
}

function filter() {
  const words = plain(byId("curve-search").value).split(/\s+/).filter(Boolean);
  for (const row of byId("curve-table").tBodies[0].rows) row.hidden = !words.every((word) => row.dataset.words.includes(word));
}

/** Show in the list what is chosen, what can be, and the count. */
function mark() {
  const full = state.list.length >= MOST;
  for (const box of curveList.querySelectorAll("td input")) {
    const [joint, channel] = box.value.split(".");
    box.checked = isChosen(joint, channel);
    box.disabled = (!box.checked && full) || (channel === "distance" && !state.beside);
  }
  if (!byId("curve-count")) return;
  setText(byId("curve-count"), t(full ? "graphs.full" : "graphs.count", { n: state.list.length, most: MOST }));
  byId("curve-clear").disabled = !state.list.length;
}

function cell(joint, channel) {
  return h("td", { class: channel }, h("input", { id: `curve-${joint}-${channel}`, type: "checkbox", value: `${joint}.${channel}`,
    aria: { label: `${joint}, ${channelWords(channel)}` }, onchange: () => toggle(joint, channel) }));
}

function build() {
  const kinds = Object.entries(SHORT);
  const row = (joint) => {
    const line = h("tr", {}, h("th", { scope: "row" }, joint), CHANNELS.map((channel) => cell(joint, channel)));
    line.dataset.words = plain(`${joint} ${hasText(`joint.${joint}`) ? t(`joint.${joint}`) : joint.replace(/([A-Z])/g, " $1")}`);
    return line;
  };
  return [
    h("div", { class: "curve-head" },
      h("input", { id: "curve-search", type: "search", placeholder: t("graphs.search"), aria: { label: t("graphs.search") }, oninput: filter }),
      h("span", { id: "curve-count", class: "count" }),
      h("button", { id: "curve-clear", type: "button", class: "small", onclick: () => keep([]) }, t("graphs.clear")),
      h("button", { id: "curve-close", type: "button", class: "small", aria: { label: t("graphs.close") }, title: `${t("graphs.close")} (Esc)`, onclick: () => showCurveList(false) }, "×")),
    h("div", { class: "curve-scroll" }, h("table", { id: "curve-table" },
      h("thead", {},
        h("tr", {}, h("th", { rowSpan: 2, scope: "col" }, t("graphs.joint")),
          kinds.map(([kind, axes]) => h("th", { colSpan: axes.length, scope: "colgroup", title: t(`channel.${kind}_hint`) }, t(`channel.${kind}`)))),
        h("tr", {}, kinds.flatMap(([, axes]) => axes.map((axis) => h("th", { scope: "col" }, axis.toUpperCase()))))),
      h("tbody", {}, ALL.map(row)))),
  ];
}

/** Keys in the list: arrows move from box to box, Escape closes it. */
function keys(event) {
  const step = COLUMN_KEYS[event.key];
  if (event.key === "Escape") showCurveList(false);
  else if (step && event.target.type === "checkbox") {
    const lines = [...byId("curve-table").tBodies[0].rows].filter((line) => !line.hidden);
    const line = lines.indexOf(event.target.closest("tr")), column = CHANNELS.findIndex((channel) => event.target.id.endsWith(`-${channel}`));
    lines[line + step[1]]?.querySelectorAll("input")[column + step[0]]?.focus();
  } else if (event.key !== " " && event.key !== "Enter") return;
  if (step || event.key === "Escape") event.preventDefault();
  event.stopPropagation();
}

/** The list to choose curves from. */
export const curveList = h("div", { id: "curve-list", class: "curve-list", role: "dialog", hidden: true, aria: { label: t("graphs.title") }, onkeydown: keys });

/** Whether the list is open. */
export const curveListShown = () => !curveList.hidden;

/** Open or close the list to choose curves from. */
export function showCurveList(shown) {
  const button = byId("replay-curves"), within = curveList.contains(document.activeElement);
  curveList.hidden = !shown;
  button?.setAttribute("aria-expanded", String(shown));
  if (shown) {
    redraw(curveList, ["curves"], build);
    mark();
    filter();
    byId("curve-search").focus();
  } else if (within) button?.focus();
}

/** The chosen curves with their values at the playhead, each with a button that removes it. */
export const curveLegend = h("ul", { id: "curve-legend", class: "curve-legend", hidden: true, aria: { label: t("graphs.legend") } });

function sample(curve) {
  const { colour, dash } = styleOf(curve);
  return svg("svg", { viewBox: "0 0 22 10", width: 22, height: 10, "aria-hidden": "true" },
    svg("line", { x1: 0, y1: 5, x2: 22, y2: 5, style: `stroke: var(${colour})`, "stroke-width": 2.5, "stroke-dasharray": dash.join(" ") }));
}

function entry(curve) {
  const { joint, channel } = curve, words = `${joint}, ${channelWords(channel)}`;
  return h("li", { title: t(`channel.${channel.split("_")[0]}_hint`) }, sample(curve), h("span", { class: "curve-name" }, h("strong", {}, joint), ` ${channelWords(channel)}`),
    h("output", { id: `curve-value-${joint}-${channel}` }),
    h("button", { type: "button", class: "small plain", aria: { label: t("graphs.remove", { curve: words }) }, title: t("graphs.remove", { curve: words }), onclick: () => remove(joint, channel) }, "×"));
}

/** Show the legend; `valueOf` returns a curve's value at the playhead in words. */
export function showLegend(valueOf) {
  const list = chosenCurves();
  curveLegend.hidden = !list.length;
  redraw(curveLegend, list, () => list.map(entry));
  for (const curve of list) setText(byId(`curve-value-${curve.joint}-${curve.channel}`), valueOf(curve));
}

/** Set whether there is a second figure, to which distances are measured. */
export function besideIs(beside) {
  if (state.beside === beside) return;
  state.beside = beside;
  mark();
}

/** Start; `changed` is called on another choice. */
export function startCurveChoice(changed) {
  state.changed = changed;
  document.addEventListener("pointerdown", (event) => {
    if (curveListShown() && !curveList.contains(event.target) && !event.target.closest("#replay-curves, #curve-legend")) showCurveList(false);
  });
  window.addEventListener("blur", () => { if (curveListShown() && document.activeElement === byId("viewer")) showCurveList(false); });
  window.addEventListener("language", () => { if (curveListShown()) showCurveList(true); });
}
