// The operator's page of blind tests: make a test of two solves, share its link, watch the votes.
import { linkTo, onlyHere, setAddress } from "../base/address.js";
import { byId, h, redraw } from "../base/dom.js";
import { blindAction, createBlindTest, createThesisTest, getAccess, getBlindResults, getBlindTests, getTakes, showBlindSlot } from "../base/api.js";
import { askSure } from "../base/ask.js";
import { startFrame } from "../base/frame.js";
import { attempt, showNote } from "../base/messages.js";
import { number as written, t } from "../base/strings.js";
import { BODIES, shownBody } from "../view/body.js";

const PERIOD_MS = 2000;
const NO_PREFERENCE = "no preference"; // as the server words a choice of neither
const state = { takes: [], tests: [], chosen: location.hash.slice(1), pairs: [] };

const percent = (value) => `${Math.round(100 * value)} %`;
const shareOf = (name, votes, of) => t("blind.share_of", { share: percent(votes / of), name, n: of });
const pWords = (p) => (p < 0.001 ? `p < ${written(0.001, 3)}` : `p = ${written(p, 3)}`);

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote(t("blind.copied"));
  } catch {
    showNote(text);
  }
}

function act(test, action, method = "POST") {
  return () => attempt(async () => { await blindAction(test.id, action, method); await refresh(); });
}

async function newLink(test) {
  if (await askSure(t("blind.new_link"), t("blind.new_link_sure"), t("blind.new_link"))) await act(test, "link")();
}

function button(text, onclick, title = "") {
  return h("button", { class: "small", type: "button", onclick, title }, text);
}

function row(test) {
  const votes = `${t("blind.voters", { n: test.voters })}, ${t("blind.votes", { n: test.votes, all: test.slots * Math.max(test.voters, 1) })}`;
  return h("li", { class: "test" },
    h("div", {}, h("strong", {}, test.title), h("span", { class: test.open ? "good" : "muted" }, t(test.open ? "blind.open" : "blind.closed"))),
    h("p", { class: "muted" }, `${t("blind.pairs", { n: test.pairs.length })} · ${votes}`),
    test.path && h("code", { class: "link" }, linkTo(test.path)),
    test.path && onlyHere() && h("p", { class: "fair" }, t("blind.only_here")),
    h("div", { class: "buttons" },
      button(t("blind.results"), () => choose(test.id)),
      test.path && button(t("blind.copy_link"), () => copy(linkTo(test.path))),
      test.path && h("a", { class: "button small", href: `api/v1/blind/${test.id}/qr`, target: "_blank", title: t("blind.qr_hint") }, t("blind.qr")),
      button(t("blind.new_link"), () => newLink(test), t("blind.new_link_hint")),
      test.closed ? button(t("blind.reopen"), act(test, "reopen")) : button(t("blind.close"), act(test, "close"), t("blind.close_hint")),
      test.rules.supervised && button(t(test.shown < 0 ? "blind.show_first" : "blind.show_next"),
        () => attempt(async () => { await showBlindSlot(test.id, test.shown + 1 < test.slots ? test.shown + 1 : -1); await refresh(); }))));
}

function options(wanted) {
  return state.takes.filter((take) => take.solves.length).flatMap((take) => take.solves.map((solve) =>
    h("option", { value: `${take.id}|${solve}`, selected: wanted === `${take.id}|${solve}` }, `${take.id}: ${solve}`)));
}

function sideOf(prefix) {
  const [take, solve] = byId(`${prefix}-solve`).value.split("|");
  return { take, solve, condition: byId(`${prefix}-condition`).value.trim() || solve, interpolation: byId(`${prefix}-keys`).value, key_hz: byId(`${prefix}-keys`).value === "linear" ? 0 : 15 };
}

function sideForm(prefix, label, at) {
  return h("fieldset", {}, h("legend", {}, label),
    h("select", { id: `${prefix}-solve`, aria: { label: t("blind.solve_of", { side: label }) } }, options(at)),
    h("input", { id: `${prefix}-condition`, type: "text", maxLength: 100, placeholder: t("blind.condition_example"), aria: { label: t("blind.condition_of", { side: label }) } }),
    h("select", { id: `${prefix}-keys`, aria: { label: t("blind.keys_of", { side: label }) } },
      [["linear", t("blind.all_keys")], ["held", t("blind.held")], ["cubic", t("blind.cubic")]].map(([value, text]) => h("option", { value }, text))));
}

function number(id, label, value) {
  return h("label", { class: "field" }, h("span", {}, label), h("input", { id, type: "number", min: 0, step: "any", value }));
}

const check = (id, label) => h("label", { class: "check" }, h("input", { id, type: "checkbox" }), label);

function addPair() {
  state.pairs.push({ a: sideOf("a"), b: sideOf("b"), start_s: Number(byId("start").value), end_s: Number(byId("end").value) });
  drawPairs();
}

function drawPairs() {
  byId("pairs").replaceChildren(...state.pairs.map((pair, i) => h("li", { class: "solve-row" },
    h("span", { class: "name" }, t("blind.against", { a: pair.a.condition, b: pair.b.condition })),
    button(t("message.remove"), () => { state.pairs.splice(i, 1); drawPairs(); }))));
  byId("make").disabled = !state.pairs.length;
}

function make(event) {
  event.preventDefault();
  const closes = byId("closes").value;
  return create({
    title: byId("test-title").value, question: byId("question").value, pairs: state.pairs,
    rules: {
      repeats: Math.min(Number(byId("repeats").value), state.pairs.length), closes: closes ? new Date(closes).toISOString() : "",
      allow_none: byId("allow-none").checked, ask_name: byId("ask-name").checked, supervised: byId("supervised").checked, body: byId("test-body").value,
    },
  });
}

/** Create a test from a JSON file in the format of the API. */
async function makeFromFile(event) {
  const [file] = event.currentTarget.files;
  event.currentTarget.value = "";
  if (!file) return;
  await attempt(async () => {
    let test;
    try {
      test = JSON.parse(await file.text());
    } catch {
      throw new Error(t("blind.no_json", { file: file.name }));
    }
    await create(test);
  });
}

async function create(wanted) {
  const test = await attempt(() => createBlindTest(wanted));
  if (!test) return;
  state.pairs = [];
  drawPairs();
  await attempt(refresh);
  choose(test.id);
}

function form() {
  const query = new URLSearchParams(location.search);
  const withSolves = state.takes.filter((take) => take.solves.length);
  if (!withSolves.length) return h("p", { class: "empty" }, t("blind.no_takes"));
  return h("form", { class: "new-test", onsubmit: make },
    h("label", { class: "field" }, h("span", {}, t("blind.test_title")), h("input", { id: "test-title", type: "text", maxLength: 500, required: true, value: t("blind.default_title") })),
    h("label", { class: "field" }, h("span", {}, t("blind.question")), h("input", { id: "question", type: "text", maxLength: 500, required: true, value: t("blind.default_question") })),
    h("div", { class: "two" }, sideForm("a", t("blind.one_side"), query.get("a")), sideForm("b", t("blind.other_side"), query.get("b"))),
    h("div", { class: "two" }, number("start", t("blind.from"), Number(query.get("start"))), number("end", t("blind.to"), Number(query.get("end")))),
    h("button", { type: "button", onclick: addPair }, t("blind.add")),
    h("ul", { id: "pairs" }),
    h("div", { class: "two" }, h("div", { class: "new-test" }, number("repeats", t("blind.repeats"), 0),
      h("label", { class: "field" }, h("span", {}, t("blind.closes")), h("input", { id: "closes", type: "datetime-local" })),
      h("label", { class: "field" }, h("span", {}, t("blind.body")), h("select", { id: "test-body" }, BODIES.map((name) => h("option", { value: name, selected: name === shownBody() }, t(`body.${name}`)))))), h("div", {}, check("allow-none", t("blind.allow_none")), check("ask-name", t("blind.ask_name")), check("supervised", t("blind.supervised")))),
    h("button", { id: "make", class: "primary", type: "submit", disabled: true }, t("blind.make")),
    h("label", { class: "field" }, h("span", {}, t("blind.from_file")), h("input", { id: "from-file", type: "file", accept: ".json,application/json", onchange: makeFromFile })),
    h("div", { class: "solve-row" }, h("select", { id: "thesis-take", aria: { label: t("blind.thesis_take") } }, withSolves.map((take) => h("option", { value: take.id }, take.id))),
      button(t("blind.thesis"), () => attempt(async () => {
        await createThesisTest(byId("thesis-take").value);
        showNote(t("blind.thesis_made"));
      }))));
}

/** Return a bar of two shares with the interval of the first. */
function bar(pair) {
  if (!pair.of) return h("p", { class: "muted" }, t("blind.no_votes"));
  return h("div", { class: "bar", role: "img", aria: { label: `${shareOf(pair.a, pair.votes_a, pair.of)}; ${shareOf(pair.b, pair.votes_b, pair.of)}` } },
    h("span", { class: "fill", style: `width: ${100 * pair.share}%` }),
    h("span", { class: "interval", style: `left: ${100 * pair.low}%; width: ${100 * (pair.high - pair.low)}%` }));
}

function pairRow(pair) {
  return h("div", { class: "result" },
    h("div", { class: "ends" }, h("span", {}, `${pair.a}: ${pair.votes_a}`), pair.no_preference > 0 && h("span", { class: "muted" }, t("blind.no_preference", { n: pair.no_preference })), h("span", {}, `${pair.b}: ${pair.votes_b}`)),
    bar(pair),
    pair.of > 0 && h("p", { class: "muted" }, t("blind.share", {
      share: shareOf(pair.a, pair.votes_a, pair.of), low: percent(pair.low), high: percent(pair.high), p: pWords(pair.p_value), corrected: pWords(pair.p_holm),
    })));
}

function resultsOf(found, test) {
  const left = found.side_bias.left;
  const same = found.consistency.of ? t("blind.same_of", { same: found.consistency.same, all: found.consistency.of }) : "–";
  return [
    h("p", { class: "muted" }, `${t("blind.voters", { n: found.voters })}, ${t("blind.summary", { finished: found.finished, left: left.of ? shareOf(t("blind.left"), left.votes, left.of) : "–", same })}`),
    ...found.pairs.map(pairRow),
    found.ranking.length > 0 && h("p", { class: "muted" }, t("blind.ranking")),
    found.ranking.length > 0 && h("ol", { class: "ranking" }, found.ranking.map((one) => h("li", {}, `${one.condition}: ${percent(one.strength)}`))),
    found.comments.length > 0 && h("ul", { class: "comments" }, found.comments.map((one) => h("li", {}, h("q", {}, one.comment), h("span", { class: "muted" }, ` ${t("blind.chose", { voter: one.voter, choice: one.chosen === NO_PREFERENCE ? t("vote.none") : one.chosen })}`)))),
    h("div", { class: "buttons" },
      h("a", { class: "button small", href: `api/v1/blind/${test}/votes.csv`, download: `${test}.csv` }, "CSV"),
      h("a", { class: "button small", href: `api/v1/blind/${test}/results`, download: `${test}.json` }, "JSON"),
      h("a", { class: "button small", href: `api/v1/blind/${test}/key`, download: `${test}_key.json` }, t("blind.sealed_key"))),
  ].filter(Boolean);
}

function choose(id) {
  state.chosen = id;
  history.replaceState(null, "", `#${id}`);
  attempt(refresh);
}

async function refresh() {
  const { tests, problems } = await getBlindTests();
  state.tests = tests;
  redraw(byId("tests"), [tests, problems], () => [
    ...problems.map((problem) => h("p", { class: "bad" }, problem)),
    tests.length ? h("ul", {}, tests.map(row)) : h("p", { class: "empty" }, t("blind.no_test")),
  ]);
  const chosen = tests.find((test) => test.id === state.chosen);
  byId("results-section").hidden = !chosen;
  if (!chosen) return;
  byId("results-title").textContent = t("blind.results_of", { title: chosen.title });
  const found = await getBlindResults(chosen.id);
  redraw(byId("results"), found, () => resultsOf(found, chosen.id));
}

startFrame();
attempt(async () => {
  setAddress(await getAccess());
  state.takes = await getTakes();
  byId("new").replaceChildren(form());
  await refresh();
  setInterval(() => { if (!document.hidden) attempt(refresh); }, PERIOD_MS);
});
