// What the server says in English, in the language of the page: its reasons, verdicts, warnings and errors.
//
// `said/*.js` holds the French of each of the server's sentences, `{name}` for a value. A value may be a sentence of
// the server itself. What stands in no table is shown as it came.
import blind from "./said/blind.js";
import calibration from "./said/calibration.js";
import exporting from "./said/export.js";
import files from "./said/files.js";
import recordings from "./said/recordings.js";
import settings from "./said/settings.js";
import stage from "./said/stage.js";
import takes from "./said/takes.js";
import { remember } from "./retell.js";
import { language, number, unbroken } from "./strings.js";

const KEPT = 300;
const known = new Map();
let patterns = null;

/** The sentences as expressions, those with the most words of their own first. */
function allPatterns() {
  const sentences = Object.entries({ ...stage, ...calibration, ...takes, ...exporting, ...settings, ...files, ...recordings, ...blind });
  return sentences.map(([english, french]) => {
    const names = [...english.matchAll(/\{(\w+)\}/g)].map(([, name]) => name);
    const parts = english.split(/\{\w+\}/);
    const source = parts.map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&")).join("(.+?)");
    return { expression: new RegExp(`^${source}$`, "s"), names, french, own: parts.join("").length };
  }).sort((a, b) => b.own - a.own);
}

function valueOf(text) {
  return /^[+-]?\d+\.\d+$/.test(text) ? number(Number(text), text.split(".")[1].length) : translated(text);
}

function translated(text) {
  for (const { expression, names, french } of patterns) {
    const match = expression.exec(text);
    if (!match) continue;
    const values = Object.fromEntries(names.map((name, i) => [name, match[i + 1]]));
    return french.replace(/\{(\w+)\}/g, (all, name) => valueOf(values[name]));
  }
  const parts = text.split("; ");
  if (parts.length > 1) return joined(text, parts, parts.map(translated), " ; ");
  const at = text.indexOf(": ");
  if (at < 0) return text;
  const rest = text.slice(at + 2);
  return joined(text, [rest], [translated(rest)], "", `${text.slice(0, at)} : `);
}

const joined = (text, before, after, between, head = "") => (after.some((part, i) => part !== before[i]) ? head + after.join(between) : text);

/** Return in the language of the page what the server says. */
export function said(text) {
  if (!text) return text;
  return remember(language === "en" ? text : inFrench(text), () => said(text), true);
}

function inFrench(text) {
  patterns ??= allPatterns();
  if (known.size > KEPT) known.clear();
  if (!known.has(text)) known.set(text, unbroken(translated(text)));
  return known.get(text);
}
