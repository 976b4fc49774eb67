// Translation of the server's English texts into the language of the page: reasons, verdicts, warnings and errors.
//
// Next to its texts, an answer or event has a list `said`: each sentence with its code and its values. `said/*.js`
// holds the French by code, `{name}` for a value, `{name:.1f}` for a number with that many digits after the point.
// A value may itself be a sentence, a list, or a joint. Messages from phones are in the page's strings (`phone_says`).
// A sentence without French is shown in English.
import blind from "./said/blind.js";
import calibration from "./said/calibration.js";
import devices from "./said/devices.js";
import edits from "./said/edits.js";
import exporting from "./said/export.js";
import files from "./said/files.js";
import recordings from "./said/recordings.js";
import robots from "./said/robots.js";
import set from "./said/set.js";
import settings from "./said/settings.js";
import stage from "./said/stage.js";
import sync from "./said/sync.js";
import takes from "./said/takes.js";
import video from "./said/video.js";
import { remember } from "./retell.js";
import { language, number, template, unbroken } from "./strings.js";

const FRENCH = { ...stage, ...calibration, ...takes, ...edits, ...exporting, ...set, ...settings, ...files, ...recordings, ...devices, ...blind, ...robots, ...sync, ...video };
const KEPT = 1000;
const sentences = new Map(); // the last sentences heard, by their English text

/** Keep the sentences of an answer, of each object in a list, or of an event; return it. */
export function hear(answer) {
  for (const one of Array.isArray(answer) ? answer : [answer]) {
    for (const sentence of one?.said ?? []) {
      sentences.delete(sentence.text);
      sentences.set(sentence.text, sentence);
    }
  }
  for (const text of sentences.keys()) {
    if (sentences.size <= KEPT) break;
    sentences.delete(text);
  }
  return answer;
}

function worded(value, format) {
  if (Array.isArray(value)) return value.map((one) => worded(one)).join(value.some((one) => one?.code) ? " ; " : ", ");
  if (typeof value === "object") return translated(value);
  if (typeof value !== "number") return value;
  const [, sign, digits] = /^(\+?)\.(\d)f$/.exec(format) ?? [];
  const shown = digits ? number(value, Number(digits)) : value.toLocaleString(language(), { maximumFractionDigits: 9, useGrouping: false });
  return sign && value >= 0 ? `+${shown}` : shown;
}

const jointWords = (name) => typeof name === "string" && template(`joint.${name.replaceAll(" ", "_")}`);

const translated = ({ text, code, values }) =>
  (FRENCH[code] ?? template(code))?.replace(/\{(\w+)(?::([^}]*))?\}/g, (all, name, format) => (name === "joint" && jointWords(values[name])) || worded(values[name], format)) ?? text;

/** Return a text of the server in the language of the page. */
export function said(text) {
  if (!text) return text;
  const sentence = language() === "en" ? undefined : sentences.get(text);
  return remember(sentence ? unbroken(translated(sentence)) : text, () => said(text), true);
}
