// The operator's page of blind tests: make one of two solves, hand out its link, see the votes come in.
import { byId, h, plural, redraw } from "./dom.js";
import { blindAction, createBlindTest, createThesisTest, getBlindResults, getBlindTests, getTakes, showBlindSlot } from "./api.js";
import { attempt, showNote } from "./messages.js";

const PERIOD_MS = 2000;
const state = { takes: [], tests: [], chosen: location.hash.slice(1), pairs: [] };

const percent = (value) => `${Math.round(100 * value)} %`;
const pWords = (p) => (p < 0.001 ? "p < 0.001" : `p = ${p.toFixed(3)}`);
const linkOf = (test) => new URL(test.path, location.origin).href;

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote("The link is copied");
  } catch {
    showNote(text);
  }
}

function act(test, action, method = "POST") {
  return () => attempt(async () => { await blindAction(test.id, action, method); await refresh(); });
}

function button(text, onclick, title = "") {
  return h("button", { class: "small", type: "button", onclick, title }, text);
}

function row(test) {
  const votes = `${plural(test.voters, "voter")}, ${plural(test.votes, "vote")} of ${test.slots * Math.max(test.voters, 1)}`;
  return h("li", { class: "test" },
    h("div", {}, h("strong", {}, test.title), h("span", { class: test.open ? "good" : "muted" }, test.open ? "open" : "closed")),
    h("p", { class: "muted" }, `${plural(test.pairs.length, "pair")} · ${votes}`),
    test.path && h("code", { class: "link" }, linkOf(test)),
    h("div", { class: "buttons" },
      button("Results", () => choose(test.id)),
      test.path && button("Copy link", () => copy(linkOf(test))),
      test.path && h("a", { class: "button small", href: `api/v1/blind/${test.id}/qr`, target: "_blank", title: "The link as a code for phones" }, "QR code"),
      button("New link", act(test, "link"), "The old link leads nowhere from now on"),
      test.closed ? button("Reopen", act(test, "reopen")) : button("Close", act(test, "close"), "Take no more votes"),
      test.rules.supervised && button(test.shown < 0 ? "Show the first pair" : "Show the next pair",
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
    h("select", { id: `${prefix}-solve`, aria: { label: `${label}: solve` } }, options(at)),
    h("input", { id: `${prefix}-condition`, type: "text", maxLength: 100, placeholder: "what it stands for, such as limits on", aria: { label: `${label}: condition` } }),
    h("select", { id: `${prefix}-keys`, aria: { label: `${label}: keys` } },
      [["linear", "all keys"], ["held", "15 keys a second, held"], ["cubic", "15 keys a second, cubic"]].map(([value, text]) => h("option", { value }, text))));
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
    h("span", { class: "name" }, `${pair.a.condition} against ${pair.b.condition}`),
    button("Remove", () => { state.pairs.splice(i, 1); drawPairs(); }))));
  byId("make").disabled = !state.pairs.length;
}

function make(event) {
  event.preventDefault();
  const closes = byId("closes").value;
  return create({
    title: byId("test-title").value, question: byId("question").value, pairs: state.pairs,
    rules: {
      repeats: Math.min(Number(byId("repeats").value), state.pairs.length), closes: closes ? new Date(closes).toISOString() : "",
      allow_none: byId("allow-none").checked, ask_name: byId("ask-name").checked, supervised: byId("supervised").checked,
    },
  });
}

/** Make a test of a file that holds what the API takes. */
async function makeFromFile(event) {
  const [file] = event.currentTarget.files;
  event.currentTarget.value = "";
  if (!file) return;
  await attempt(async () => {
    let test;
    try {
      test = JSON.parse(await file.text());
    } catch {
      throw new Error(`${file.name} is no JSON; docs/blind_tests.md shows what a test looks like.`);
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
  if (!withSolves.length) return h("p", { class: "empty" }, "A test needs takes with solves. Record one on the stage first.");
  return h("form", { class: "new-test", onsubmit: make },
    h("label", { class: "field" }, h("span", {}, "Title"), h("input", { id: "test-title", type: "text", maxLength: 500, required: true, value: "Which settings?" })),
    h("label", { class: "field" }, h("span", {}, "Question"), h("input", { id: "question", type: "text", maxLength: 500, required: true, value: "Which of the two movements looks better?" })),
    h("div", { class: "two" }, sideForm("a", "One side", query.get("a")), sideForm("b", "Other side", query.get("b"))),
    h("div", { class: "two" }, number("start", "From [s]", 0), number("end", "To [s], 0: the end", 0)),
    h("button", { type: "button", onclick: addPair }, "Add this pair"),
    h("ul", { id: "pairs" }),
    h("div", { class: "two" }, h("div", { class: "new-test" }, number("repeats", "Pairs shown twice", 0),
      h("label", { class: "field" }, h("span", {}, "Closes"), h("input", { id: "closes", type: "datetime-local" }))), h("div", {}, check("allow-none", "No preference allowed"), check("ask-name", "Ask for a name"), check("supervised", "A room sees one pair at a time"))),
    h("button", { id: "make", class: "primary", type: "submit", disabled: true }, "Make the test"),
    h("label", { class: "field" }, h("span", {}, "From a file"), h("input", { id: "from-file", type: "file", accept: ".json,application/json", onchange: makeFromFile })),
    h("div", { class: "solve-row" }, h("select", { id: "thesis-take", aria: { label: "Take for the thesis's pairs" } }, withSolves.map((take) => h("option", { value: take.id }, take.id))),
      button("The thesis's ten pairs of this take", () => attempt(async () => {
        await createThesisTest(byId("thesis-take").value);
        showNote("The take is being solved in ten ways; the test comes up here when it is made");
      }))));
}

/** A bar of two shares with the interval of the first. */
function bar(pair) {
  if (!pair.of) return h("p", { class: "muted" }, "no votes yet");
  return h("div", { class: "bar", role: "img", aria: { label: `${pair.a} ${percent(pair.share)}, ${pair.b} ${percent(1 - pair.share)}` } },
    h("span", { class: "fill", style: `width: ${100 * pair.share}%` }),
    h("span", { class: "interval", style: `left: ${100 * pair.low}%; width: ${100 * (pair.high - pair.low)}%` }));
}

function pairRow(pair) {
  return h("div", { class: "result" },
    h("div", { class: "ends" }, h("span", {}, `${pair.a}: ${pair.votes_a}`), pair.no_preference > 0 && h("span", { class: "muted" }, `no preference: ${pair.no_preference}`), h("span", {}, `${pair.b}: ${pair.votes_b}`)),
    bar(pair),
    pair.of > 0 && h("p", { class: "muted" }, `${percent(pair.share)} (95 %: ${percent(pair.low)} to ${percent(pair.high)}) · ${pWords(pair.p_value)} · corrected ${pWords(pair.p_holm)}`));
}

function resultsOf(found, test) {
  const left = found.side_bias.left;
  return [
    h("p", { class: "muted" }, `${plural(found.voters, "voter")}, ${found.finished} finished · left chosen ${left.of ? percent(left.share) : "–"} · same choice when repeated: ${found.consistency.of ? `${found.consistency.same} of ${found.consistency.of}` : "–"}`),
    ...found.pairs.map(pairRow),
    found.ranking.length > 0 && h("ol", { class: "ranking" }, found.ranking.map((one) => h("li", {}, `${one.condition}: ${percent(one.strength)}`))),
    found.comments.length > 0 && h("ul", { class: "comments" }, found.comments.map((one) => h("li", {}, h("q", {}, one.comment), h("span", { class: "muted" }, ` ${one.voter}, chose ${one.chosen}`)))),
    h("div", { class: "buttons" },
      h("a", { class: "button small", href: `api/v1/blind/${test}/votes.csv`, download: `${test}.csv` }, "CSV"),
      h("a", { class: "button small", href: `api/v1/blind/${test}/results`, download: `${test}.json` }, "JSON"),
      h("a", { class: "button small", href: `api/v1/blind/${test}/key`, download: `${test}_key.json` }, "Sealed key")),
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
    tests.length ? h("ul", {}, tests.map(row)) : h("p", { class: "empty" }, "No test yet."),
  ]);
  const chosen = tests.find((test) => test.id === state.chosen);
  byId("results-section").hidden = !chosen;
  if (!chosen) return;
  byId("results-title").textContent = `Results: ${chosen.title}`;
  const found = await getBlindResults(chosen.id);
  redraw(byId("results"), found, () => resultsOf(found, chosen.id));
}

attempt(async () => {
  state.takes = await getTakes();
  byId("new").replaceChildren(form());
  await refresh();
  setInterval(() => { if (!document.hidden) attempt(refresh); }, PERIOD_MS);
});
