// Several performers on the stage, as a list in the performer panel: colour, name, height, state, and actions.
import { byId, h, redraw } from "../base/dom.js";
import { exchangePerformers, forgetPerformer, keepProfile, renamePerformer } from "../base/api.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";
import { colourOf } from "./people_colour.js";

const TONES = { here: "good", measuring: "good", undecided: "fair", away: "muted", stranger: "muted" };

const RENAME = undoing("rename-performer", (name, old) => attempt(() => renamePerformer(name, old)));
const EXCHANGE = undoing("exchange-performers", (first, second) => attempt(() => exchangePerformers(first, second)));

async function rename(old, input) {
  const name = input.value.trim();
  if (name === old) return;
  if (name && await attempt(() => renamePerformer(old, name))) showUndo(t("people.renamed", { old, name }), RENAME, name, old);
  else input.value = old;
}

async function exchange(first, second) {
  if (await attempt(() => exchangePerformers(first, second))) showUndo(t("people.exchanged", { first, second }), EXCHANGE, first, second);
}

async function keep(name) {
  if (await attempt(() => keepProfile(name))) showNote(t("people.kept", { name }));
}

function nameOf({ number: place, name }) {
  if (!place) return h("span", { class: "name muted" }, t("people.stranger"));
  const input = h("input", {
    id: `person-${place}`, class: "name", type: "text", maxLength: 60, value: name, spellcheck: false, autocomplete: "off",
    aria: { label: t("people.name", { name }) }, title: t("people.name_hint"),
    onchange: () => rename(name, input), onkeydown: (event) => { if (event.key === "Enter") input.blur(); },
  });
  return input;
}

function acts({ number: place, name, profile }) {
  return h("span", { class: "acts operate" },
    h("button", { class: "small", type: "button", title: t("people.keep_hint"), aria: { label: t("people.keep_label", { name }) }, onclick: () => keep(name) },
      t(profile ? "people.keep_again" : "people.keep")),
    place > 1 && h("button", { class: "small", type: "button", title: t("people.forget_hint"), aria: { label: t("people.forget_label", { name }) }, onclick: () => attempt(() => forgetPerformer(name)) },
      t("people.forget")));
}

function row(one, colours) {
  return h("li", { class: "person" },
    h("span", { class: "swatch", style: `background:${colourOf(one, colours)}`, aria: { hidden: "true" } }),
    nameOf(one),
    h("span", { class: "count" }, one.height_m ? `${number(one.height_m, 2)} m` : ""),
    h("span", { class: `state ${TONES[one.state]}` }, t(`people.state.${one.state}`)),
    one.message && one.state !== "away" && h("p", { class: "why muted" }, said(one.message)),
    one.number && acts(one));
}

/** Return a button for each pair of performers: one click exchanges them. */
function exchanges(names) {
  const pairs = names.flatMap((first, place) => names.slice(place + 1).map((second) => [first, second]));
  return pairs.length > 0 && h("div", { class: "exchanges operate", role: "group", aria: { label: t("people.exchange_title") } }, pairs.map(([first, second]) => h("button", {
    class: "small exchange", type: "button", title: t("people.exchange_hint"), aria: { label: t("people.exchange", { first, second }) },
    onclick: () => exchange(first, second),
  }, `${first} ⇄ ${second}`)));
}

/** Show all people on a stage of several performers, in the view's colours; hidden without several. */
export function updatePeople({ performers, performer_warnings: warnings }, colours) {
  const names = performers.filter((one) => one.number).map((one) => one.name);
  const place = byId("people");
  place.hidden = performers.length === 0;
  redraw(place, [performers, warnings, colours], () => (performers.length === 0 ? [] : [
    h("ul", { class: "people" }, performers.map((one) => row(one, colours))),
    exchanges(names),
    ...warnings.map((words) => h("p", { class: "fair person-warning", role: "status" }, said(words))),
  ].filter(Boolean)));
}
