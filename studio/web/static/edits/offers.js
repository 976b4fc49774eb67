// The repair list, in order: each clean-up event of the replayed solve, its cause, a proposed edit, and its effect.
import { getOffers } from "../base/api.js";
import { clock, h } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";
import { editSpans } from "../replay/curves.js";
import { add, isSolved } from "./list.js";
import { wordsOf } from "./words.js";

const SAME_S = 0.1; // events of one solve and the next that are so near are the same
const state = { of: "", offers: null, applied: [], withAll: false, changed: () => {} }; // `applied`: events whose offer was taken; `withAll`: the offers are of a solve with all edits

const named = (takeId) => ({ session: takeId.slice(0, takeId.indexOf("/")), name: takeId.slice(takeId.indexOf("/") + 1) });
const keyOf = ({ take, solve, performer }) => JSON.stringify([take, solve, performer]);

/** Return the key by which the list is redrawn. */
export const offersKey = (replay) => (state.of === keyOf(replay) ? [state.offers, state.applied] : null);

/** Load the offers for the replayed solve. */
async function load(replay) {
  const of = keyOf(replay);
  if (state.of !== of) Object.assign(state, { of, offers: null, applied: [] });
  const withAll = isSolved();
  const found = await attempt(() => getOffers(named(replay.take), replay.solve, replay.performer));
  if (!found || state.of !== of) return;
  Object.assign(state, { withAll, offers: found.offers.sort((one, other) => one.event.peak_s - other.event.peak_s) });
  state.changed();
}

/** Handle that the replayed solve was made again: if its offers are shown, load the new ones. */
export function offersAgain(replay) {
  if (state.of === keyOf(replay) && state.offers) load(replay);
}

const same = (one, other) => one.kind === other.kind && one.joint === other.joint && one.start_s <= other.end_s + SAME_S && one.end_s >= other.start_s - SAME_S;

function apply(offer) {
  const { id: _, note: __, ...edit } = offer.edits[0];
  state.applied = [...state.applied.filter((one) => !same(one, offer.event)), offer.event];
  add(edit);
}

function row(event, offer, replay, goTo) {
  const [[, , words]] = editSpans([event], replay.begins_s, replay.rate_hz);
  const taken = state.applied.some((one) => same(one, event));
  const outcome = !offer ? "gone" : state.withAll && isSolved() ? "still" : "pending";
  return h("li", {},
    h("div", { class: "edit-row" },
      h("button", { type: "button", class: "small quiet edit-go", title: t("mend.go", { what: words }), onclick: () => goTo(Math.round((event.peak_s - replay.begins_s) * replay.rate_hz)) },
        h("span", {}, words), h("span", { class: "count" }, clock(Math.max(event.peak_s - replay.begins_s, 0)))),
      offer?.edits.length > 0 && h("button", { type: "button", class: "small operate", aria: { label: t("mend.apply_to", { what: words, edit: wordsOf(offer.edits[0]) }) }, onclick: () => apply(offer) }, t("mend.apply"))),
    offer && h("p", { class: "muted" }, said(offer.why)),
    offer?.edits.length > 0 && h("p", { class: "muted" }, wordsOf(offer.edits[0])),
    taken && h("p", { class: offer ? "fair" : "good" }, t(`mend.${outcome}`)));
}

/** Return the repair list: a button that loads it, then its rows. */
export function offerList(replay, goTo) {
  const shown = state.of === keyOf(replay) && state.offers;
  const gone = shown ? state.applied.filter((event) => !state.offers.some((one) => same(one.event, event))) : [];
  return h("div", {},
    h("button", { id: "edit-offers", type: "button", class: "small", title: t("mend.offers_hint"), onclick: () => load(replay) }, shown ? t("mend.offers_count", { n: state.offers.length }) : t("mend.offers")),
    shown && h("ul", { class: "edit-list", id: "offer-list" }, gone.map((event) => row(event, null, replay, goTo)), state.offers.map((one) => row(one.event, one, replay, goTo))));
}

/** Start; `changed` is called when the offers change. */
export function startOffers(changed) {
  state.changed = changed;
}
