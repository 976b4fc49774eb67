// Every word of the interface, in English and French: `t("key", {values})`, and `data-t` attributes in templates.
//
// The words are in `strings/`, one file per part of the page, as `"key": ["English", "French"]`. `{name}` is a
// value; `{n} take|{n} takes` has a singular and a plural, chosen by the value `n`. If an English text is null,
// `serverText` uses the server's. `retell.js` notes the source of each text, so that a change of language
// shows in place; code that draws, or formats dates, listens to the window's `language` event.
import { own, remember, retellAll, retold } from "./retell.js";
import access from "./strings/access.js";
import blind from "./strings/takes/blind.js";
import calibration from "./strings/stage/calibration.js";
import cameras from "./strings/stage/cameras.js";
import curves from "./strings/takes/curves.js";
import compare from "./strings/takes/compare.js";
import exporting from "./strings/takes/export.js";
import graphs from "./strings/takes/graphs.js";
import help from "./strings/help.js";
import importing from "./strings/takes/import.js";
import mend from "./strings/takes/mend.js";
import page from "./strings/page.js";
import people from "./strings/stage/people.js";
import performers from "./strings/stage/performers.js";
import phone from "./strings/stage/phone.js";
import points from "./strings/stage/points.js";
import record from "./strings/stage/record.js";
import replay from "./strings/takes/replay.js";
import robots from "./strings/stage/robots.js";
import set from "./strings/stage/set.js";
import share from "./strings/takes/share.js";
import switches from "./strings/stage/switches.js";
import takes from "./strings/takes/takes.js";
import video from "./strings/takes/video.js";
import view from "./strings/stage/view.js";
import wizard from "./strings/stage/wizard.js";
import work from "./strings/work.js";

const TEXTS = { ...access, ...blind, ...calibration, ...cameras, ...compare, ...curves, ...exporting, ...graphs, ...help, ...importing, ...mend, ...page, ...people, ...performers, ...phone, ...points, ...record, ...replay, ...robots, ...set, ...share, ...switches, ...takes, ...video, ...view, ...wizard, ...work };
const KEPT = "language";
const ATTRIBUTES = { t: null, tTitle: "title", tAria: "aria-label", tPlaceholder: "placeholder", tAlt: "alt" };

export const LANGUAGES = { en: "English", fr: "Français" };

function chosen() {
  const kept = localStorage.getItem(KEPT);
  if (kept in LANGUAGES) return kept;
  return navigator.language.toLowerCase().startsWith("fr") ? "fr" : "en";
}

/** The language of the interface: "en" or "fr". */
export const language = () => document.documentElement.lang;
let column = 0;
let rules = null;

function use(code) {
  column = Object.keys(LANGUAGES).indexOf(code);
  rules = new Intl.PluralRules(code);
  document.documentElement.lang = code;
}

/** Store the chosen language and show the page in it, in place; dispatches `language` on the window. */
export function chooseLanguage(wanted) {
  localStorage.setItem(KEPT, wanted);
  use(wanted);
  retellAll(document.documentElement);
  window.dispatchEvent(new Event("language"));
}

/** Return a text in which French spaces around punctuation do not break a line. */
export const unbroken = (text) => (language() === "fr" ? text.replace(/ ([?!:;»%])/g, "\u00a0$1").replace(/« /g, "«\u00a0") : text);

/** Return the words of a key with its values filled in. */
export function t(key, values = {}) {
  const text = TEXTS[key]?.[column];
  if (typeof text !== "string") {
    console.error(`no words for ${key}`);
    return key;
  }
  const forms = text.split("|");
  const form = forms.length > 1 && rules.select(Number(values.n)) !== "one" ? forms[1] : forms[0];
  const words = unbroken(form).replace(/\{(\w+)\}/g, (all, name) => (name in values ? String(values[name]) : all));
  const again = () => (hasText(key) ? t(key, Object.fromEntries(Object.entries(values).map(([name, value]) => [name, retold(value)]))) : words);
  return remember(words, again, Object.keys(values).length > 0);
}

/** Return a text without its values filled in: in the page's language, or in English; undefined if there is none. */
export const template = (key, english = false) => TEXTS[key]?.[english ? 0 : column];

/** Return a text without accents and capitals, for searching. */
export const plain = (text) => text.normalize("NFD").replace(/\p{Diacritic}/gu, "").toLowerCase();

/** Whether there are words for a key. */
export const hasText = (key) => typeof TEXTS[key]?.[column] === "string";

/** Return the words of a key, or the server's text if there are none in this language. */
export const serverText = (key, said) => remember(hasText(key) ? t(key) : said, () => serverText(key, said), true);

/** Return a number as the language writes it, with `digits` digits after the point. */
export const number = (value, digits = 0) => remember(
  value.toLocaleString(language(), { minimumFractionDigits: digits, maximumFractionDigits: digits, signDisplay: "negative" }), () => number(value, digits), true);

/** Fill in the words of elements with `data-t` (text), `data-t-title`, `data-t-aria`, `data-t-placeholder`, `data-t-alt`. */
export function translate(root) {
  for (const [name, attribute] of Object.entries(ATTRIBUTES)) {
    const selector = `data-${name.replace(/[A-Z]/g, (letter) => `-${letter.toLowerCase()}`)}`;
    for (const element of root.querySelectorAll(`[${selector}]`)) {
      const text = t(element.dataset[name]);
      if (attribute) element.setAttribute(attribute, text);
      else element.textContent = text;
      own(attribute ? element : element.firstChild, attribute ?? "", text);
    }
  }
}

use(chosen());
translate(document);
delete document.documentElement.dataset.words;
