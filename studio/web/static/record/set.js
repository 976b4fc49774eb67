// Panel for a set: the incoming timecode, large next to the recording, and the triggers with what they received.
import { byId, h, redraw, setText } from "../base/dom.js";
import { changeTriggers, getTriggers, putTimecode } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const RATES = ["23.976", "24", "25", "29.97df", "29.97", "30", "47.952", "48", "50", "59.94df", "59.94", "60"];
const TRIGGERS = ["xml", "osc", "midi", "xml_out", "webhooks"];
const FIELDS = { xml: ["xml_port"], osc: ["osc_port"], midi: ["midi_device", "midi_note"], xml_out: ["xml_targets"], webhooks: ["webhook_urls"] };
const LISTS = ["xml_targets", "webhook_urls"];
const NUMBERS = ["xml_port", "osc_port", "midi_note"];

const panel = { settings: null, heardAt: 0, timecode: null, source: null, rate: null };

/** Return the timecode some milliseconds after a received one; numbers that drop-frame skips are corrected by the next one. */
function after(text, rate, ms) {
  const count = Math.round(parseFloat(rate));
  const [hours, minutes, seconds, frames] = text.split(/[:;]/).map(Number);
  const total = ((hours * 60 + minutes) * 60 + seconds) * count + frames + Math.floor(ms / 1000 * parseFloat(rate));
  const two = (value) => String(value).padStart(2, "0");
  const whole = Math.floor(total / count);
  return `${two(Math.floor(whole / 3600) % 24)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}${text[8]}${two(total % count)}`;
}

/** Return the current timecode, "" if there is none. */
export function timecodeNow() {
  const { timecode } = panel;
  return timecode?.timecode ? after(timecode.timecode, timecode.rate, performance.now() - panel.heardAt) : "";
}

function tick() {
  const place = byId("timecode");
  setText(place, timecodeNow());
  if (!place.hidden) requestAnimationFrame(tick);
}

let asked = Promise.resolve(); // one change after the other, in the order in which they were made

function listen(source, rate) {
  asked = asked.then(() => attempt(() => putTimecode(source.trim() || "off", rate)));
}

function timecodePart(timecode) {
  const rate = h("select", {
    id: "timecode-rate", aria: { label: t("set.rate") }, onchange: (event) => { panel.rate = event.currentTarget.value; listen(byId("timecode-source").value, panel.rate); },
  }, RATES.map((value) => h("option", { value, selected: value === (panel.rate ?? timecode.rate) }, value)));
  const source = h("input", {
    id: "timecode-source", type: "text", spellcheck: false, value: panel.source ?? timecode.source,
    aria: { label: t("set.source") }, title: t("set.source_hint"),
    onchange: (event) => { panel.source = event.currentTarget.value; listen(panel.source, byId("timecode-rate").value); },
  });
  source.setAttribute("list", "timecode-sources");
  const state = `${t(`set.state.${timecode.state}`)}${timecode.drift_ppm === null ? "" : `, ${t("set.drift", { ppm: number(timecode.drift_ppm, 0) })}`}`;
  return h("div", { class: "set-timecode" },
    h("div", { class: "set-row" }, h("label", { class: "field" }, h("span", {}, t("set.timecode")), source), rate),
    h("datalist", { id: "timecode-sources" }, ["off", "clock", "ltc:alsa:default", "mtc:/dev/snd/midiC1D0", "artnet:0.0.0.0"].map((value) => h("option", { value }))),
    h("p", { class: "count", id: "timecode-state" }, state),
    timecode.problem && h("p", { class: "bad" }, said(timecode.problem)));
}

const valueOf = (name, text) => (LISTS.includes(name) ? text.split(/[\s,]+/).filter(Boolean) : NUMBERS.includes(name) ? Number(text) : text.trim());

const change = (changes) => attempt(async () => { show(await changeTriggers(changes)); });

function field(name, settings) {
  return h("label", { class: "field" }, h("span", {}, t(`set.${name}`)),
    h("input", {
      id: `trigger-${name}`, type: "text", spellcheck: false, value: String(LISTS.includes(name) ? settings[name].join(" ") : settings[name]),
      inputMode: NUMBERS.includes(name) ? "numeric" : "text",
      onchange: (event) => change({ [name]: valueOf(name, event.currentTarget.value) }),
    }));
}

function heardWords({ on, heard, refused, last, answer, problem }) {
  if (!on) return "";
  const words = last ? t("set.last", { heard, refused, last }) : t("set.nothing");
  return h("p", { class: problem ? "bad" : "count" }, problem ? said(problem) : answer ? `${words}: ${said(answer)}` : words);
}

function row(name, settings, status) {
  const fields = FIELDS[name].map((one) => field(one, settings));
  return h("li", { class: "trigger" },
    h("label", { class: "check" },
      h("input", {
        id: `trigger-${name}`, type: "checkbox", checked: settings[name],
        onchange: (event) => change({ [name]: event.currentTarget.checked, ...Object.fromEntries(FIELDS[name].map((one) => [one, valueOf(one, byId(`trigger-${one}`).value)])) }),
      }),
      h("span", { class: "name", title: t(`set.${name}.hint`) }, t(`set.${name}`))),
    h("div", { class: "set-row" }, fields),
    heardWords(status));
}

function show({ settings, status }) {
  panel.settings = settings;
  draw(status);
}

function draw(status) {
  const { settings, timecode } = panel;
  if (!settings || !timecode || byId("set").contains(document.activeElement) && document.activeElement.matches("input[type=text], select")) return;
  const on = TRIGGERS.filter((name) => settings[name]).length;
  setText(byId("set-count"), [timecode.state === "off" ? "" : timecode.source, on ? t("set.on", { n: on }) : ""].filter(Boolean).join(", "));
  const shown = TRIGGERS.map((name) => ({ ...status[name], last_s: 0 })); // what changes by itself draws nothing anew
  const drift_ppm = timecode.drift_ppm === null ? null : Math.round(timecode.drift_ppm);
  redraw(byId("set"), [settings, shown, status.problem, { ...timecode, timecode: "", drift_ppm }], () => [
    timecodePart({ ...timecode, drift_ppm }),
    status.problem && h("p", { class: "bad" }, said(status.problem)),
    h("ul", { class: "triggers" }, TRIGGERS.map((name) => row(name, settings, status[name]))),
    h("div", { class: "set-row" }, field("host", settings), field("token", settings)),
  ].filter(Boolean));
}

/** Show the timecode and what the triggers received, as last reported by the server. */
export function updateSet(timecode, triggers) {
  Object.assign(panel, { timecode, heardAt: performance.now(), source: null, rate: null });
  const place = byId("timecode");
  const hidden = !timecode.timecode;
  place.dataset.state = timecode.state;
  place.title = t(`set.state.${timecode.state}`);
  if (place.hidden !== hidden) {
    place.hidden = hidden;
    tick();
  }
  draw(triggers);
}

/** Request the settings of the triggers. */
export const startSet = () => attempt(async () => { panel.settings = (await getTriggers()).settings; });
