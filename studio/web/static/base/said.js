// What the server says in English, in the language of the page: its reasons, verdicts, warnings and errors.
//
// An answer or event has beside its texts a list `said`: each sentence in it with its code and its values. `said/*.js`
// holds the French by code, `{name}` for a value, `{name:.1f}` for a number with so many digits after the point.
// A value may be a sentence itself, or a list. What has no French is shown as it came.
import blind from "./said/blind.js";
import calibration from "./said/calibration.js";
import exporting from "./said/export.js";
import files from "./said/files.js";
import recordings from "./said/recordings.js";
import settings from "./said/settings.js";
import stage from "./said/stage.js";
import takes from "./said/takes.js";
import { language, number, unbroken } from "./strings.js";

const FRENCH = { ...stage, ...calibration, ...takes, ...exporting, ...settings, ...files, ...recordings, ...blind };
const KEPT = 1000;
const sentences = new Map(); // the last sentences heard, by their English text

/** Keep the sentences of an answer, of each object in a list, or of an event; returns it. */
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
  const shown = digits ? number(value, Number(digits)) : value.toLocaleString(language, { maximumFractionDigits: 9, useGrouping: false });
  return sign && value >= 0 ? `+${shown}` : shown;
}

const translated = ({ text, code, values }) =>
  FRENCH[code]?.replace(/\{(\w+)(?::([^}]*))?\}/g, (all, name, format) => worded(values[name], format)) ?? text;

const known = new Map();
let patterns = null;

/** The sentences as expressions, those with the most words of their own first. */
function allPatterns() {
  const sentences = Object.entries(FRENCH).filter(([key]) => !/^\w+\.\w+$/.test(key));
  return sentences.map(([english, french]) => {
    const names = [...english.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
    const parts = english.split(/\{\w+\}/);
    const source = parts.map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.+?)");
    return { expression: new RegExp(`^${source}$`, "s"), names, french, own: parts.join("").length };
  }).sort((a, b) => b.own - a.own);
}

function valueOf(text) {
  return /^[+-]?\d+\.\d+$/.test(text) ? number(Number(text), text.split(".")[1].length) : matched(text);
}

function matched(text) {
  for (const { expression, names, french } of patterns) {
    const match = expression.exec(text);
    if (!match) continue;
    const values = Object.fromEntries(names.map((name, i) => [name, match[i + 1]]));
    return french.replace(/\{(\w+)\}/g, (all, name) => valueOf(values[name]));
  }
  const parts = text.split("; ");
  if (parts.length > 1) return joined(text, parts, parts.map(matched), " ; ");
  const at = text.indexOf(": ");
  if (at < 0) return text;
  const rest = text.slice(at + 2);
  return joined(text, [rest], [matched(rest)], "", `${text.slice(0, at)} : `);
}

const joined = (text, before, after, between, head = "") => (after.some((part, i) => part !== before[i]) ? head + after.join(between) : text);

/** Return in the language of the page what the server says. */
export function said(text) {
  if (language === "en" || !text) return text;
  if (sentences.has(text) && sentences.get(text).code in FRENCH) return unbroken(translated(sentences.get(text)));
  patterns ??= allPatterns();
  if (known.size > 300) known.clear();
  if (!known.has(text)) known.set(text, unbroken(matched(text)));
  return known.get(text);
}
