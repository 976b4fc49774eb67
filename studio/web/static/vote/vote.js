// The voters' page: join, see the pairs in one's own order, choose, change, continue after a reload. The names of what is
// compared never reach it.
import { h } from "../base/dom.js";
import { hear, said } from "../base/said.js";
import { t } from "../base/strings.js";
import { Players } from "./players.js";
import { turns } from "../base/turns.js";

const token = decodeURIComponent(location.pathname.split("/").pop());
const ROOT = new URL(`../api/v1/vote/${encodeURIComponent(token)}`, document.baseURI).href;
const KEPT = `voter-${token}`;
const RETRY_MS = 1500;
const POLL_MS = 1000;
const byId = (id) => document.getElementById(id);
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

const state = { voter: localStorage.getItem(KEPT) ?? "", test: null, slot: -1, players: null, watched: 0, since: 0 };

class Refused extends Error {
  constructor(status, message) {
    super(message);
    this.status = status;
  }
}

/** Send a request; a dropped connection is retried until it works: votes may be sent twice. */
async function ask(method, path, body, read = "json") {
  for (;;) {
    let response;
    try {
      response = await fetch(ROOT + path, {
        method, headers: { "X-Voter": state.voter, ...(body ? { "Content-Type": "application/json" } : {}) },
        body: body && JSON.stringify(body),
      });
    } catch {
      showTrouble(t("vote.no_connection"));
      await pause(RETRY_MS);
      continue;
    }
    showTrouble("");
    if (response.ok) return response[read]();
    if (response.status === 429) {
      await pause(RETRY_MS);
      continue;
    }
    const value = await response.json().catch(() => null);
    throw new Refused(response.status, said(hear(value?.error)?.message) ?? t("server.status", { status: response.status }));
  }
}

function showTrouble(text) {
  const place = byId("trouble");
  if (place) place.textContent = text;
}

function say(...content) {
  leavePair();
  byId("main").replaceChildren(h("div", { class: "words" }, ...content));
}

function leavePair() {
  state.players?.dispose();
  state.players = null;
}

async function join(name) {
  const { voter } = await ask("POST", "/join", { name });
  state.voter = voter;
  localStorage.setItem(KEPT, voter);
  await begin();
}

function welcome() {
  const { title, question, pairs, ask_name: asks } = state.test;
  const name = h("input", { type: "text", maxLength: 60, placeholder: t("vote.name_example"), aria: { label: t("vote.name") } });
  say(h("h2", {}, question), h("p", {}, t("vote.welcome", { n: pairs })),
    h("form", { onsubmit: (event) => { event.preventDefault(); attempt(() => join(asks ? name.value : "")); } },
      asks && name, h("button", { class: "primary", type: "submit" }, t("vote.begin")), h("p", { id: "trouble", class: "bad" })));
  byId("title").textContent = title;
}

function done() {
  byId("place").textContent = "";
  say(h("h2", {}, t("vote.thanks")), h("p", {}, t("vote.done")),
    h("form", { onsubmit: (event) => { event.preventDefault(); show(0); } }, h("button", { type: "submit" }, t("vote.look_again"))));
}

/** Seconds that the pair has been on the screen. */
function watchedNow() {
  return state.watched + (document.hidden || !state.since ? 0 : (performance.now() - state.since) / 1000);
}

function countWatching() {
  state.watched = watchedNow();
  state.since = document.hidden ? 0 : performance.now();
}
document.addEventListener("visibilitychange", () => {
  if (document.hidden) {
    state.watched += state.since ? (performance.now() - state.since) / 1000 : 0;
    state.since = 0;
  } else {
    state.since = performance.now();
  }
});

function markChoice(choice) {
  for (const button of document.querySelectorAll(".choice")) button.setAttribute("aria-pressed", String(button.value === choice));
  for (const side of ["left", "right"]) byId(side)?.classList.toggle("chosen", side === choice);
  if (byId("next")) byId("next").disabled = !choice;
}

/** Votes are sent one after the other, so that the last one counts. */
const inTurn = turns();
let saving;
const wanted = new Map();

async function vote(choice) {
  const slot = state.slot;
  const now = choice ?? wanted.get(slot) ?? state.test.votes[slot]?.choice;
  if (!now) return;
  wanted.set(slot, now);
  markChoice(now);
  countWatching();
  byId("kept").textContent = "";
  const sent = { choice: now, watched_s: state.watched, comment: byId("comment").value };
  const mine = inTurn(() => ask("PUT", `/${slot}`, sent));
  saving = mine;
  Object.assign(state.test, await mine);
  if (mine === saving && slot === state.slot) byId("kept").textContent = t("vote.kept");
}

function choiceButton(value, text) {
  return h("button", { class: "choice", type: "button", value, onclick: () => attempt(() => vote(value)), aria: { pressed: "false" } }, text);
}

function controls(slot) {
  const { test } = state;
  const own = test.votes[slot];
  const last = slot === test.pairs - 1;
  return [
    h("div", { class: "transport" },
      h("button", { id: "play", type: "button", onclick: () => state.players?.toggle(), aria: { label: t("vote.play") } }, "❚❚"),
      h("input", { id: "scrub", type: "range", min: 0, max: 1, step: "any", value: 0, aria: { label: t("vote.time") }, oninput: (event) => state.players?.seek(Number(event.currentTarget.value)) }),
      h("select", { id: "speed", aria: { label: t("vote.speed") }, onchange: (event) => { if (state.players) state.players.speed = Number(event.currentTarget.value); } },
        [[1, "1×"], [0.5, "½×"], [0.25, "¼×"]].map(([value, text]) => h("option", { value }, text)))),
    h("div", { class: "choices" },
      choiceButton("left", "A"), test.allow_none && choiceButton("none", t("vote.none")), choiceButton("right", "B"),
      h("textarea", { id: "comment", maxLength: 1000, placeholder: t("vote.why"), value: own?.comment ?? "", aria: { label: t("vote.comment") }, onchange: () => attempt(() => vote()) }),
      h("div", { class: "row" },
        !test.supervised && h("button", { type: "button", disabled: slot === 0, onclick: () => attempt(() => show(slot - 1)) }, t("vote.back")),
        h("p", {}, h("span", { id: "kept", role: "status" }), h("span", { id: "trouble", class: "bad" })),
        !test.supervised && h("button", { id: "next", class: "primary", type: "button", disabled: !own, onclick: () => (last ? done() : attempt(() => show(slot + 1))) }, t(last ? "vote.finish" : "vote.next")))),
  ];
}

async function show(slot) {
  leavePair();
  state.slot = slot;
  state.watched = 0;
  state.since = document.hidden ? 0 : performance.now();
  byId("place").textContent = t("vote.place", { at: slot + 1, all: state.test.pairs });
  const stage = (id, label) => h("div", { class: "stage", id }, h("canvas", { aria: { label: t("vote.animation", { label }) } }), h("b", {}, label));
  byId("main").replaceChildren(h("div", { class: "pair" },
    h("p", { class: "question" }, state.test.question),
    h("div", { class: "stages" }, stage("left", "A"), stage("right", "B")),
    ...controls(slot)));
  markChoice(state.test.votes[slot]?.choice);
  const files = await Promise.all(["left", "right"].map((side) => ask("GET", `/${slot}/${side}`, undefined, "arrayBuffer")));
  if (state.slot !== slot) return;
  const canvases = ["left", "right"].map((side) => byId(side).querySelector("canvas"));
  state.players = await Players.open(canvases, files, (share, playing) => {
    byId("scrub").value = share;
    byId("play").textContent = playing ? "❚❚" : "▶";
  });
  document.body.dataset.ready = String(slot);
}

/** In a supervised test the room sees one pair; follow the operator. */
async function followRoom() {
  let seen = null;
  for (;;) {
    const test = await ask("GET", "");
    state.test = test;
    if (!test.open) {
      over();
      return;
    }
    if (test.shown !== seen) {
      seen = test.shown;
      if (seen < 0) say(h("p", {}, t("vote.wait")));
      else await show(seen);
    }
    await pause(POLL_MS);
  }
}

const over = () => say(h("h2", {}, t("vote.over")), h("p", {}, `${t("vote.thanks")}.`));

async function begin() {
  state.test = await ask("GET", "");
  byId("title").textContent = state.test.title;
  if (!state.test.open) over();
  else if (!state.voter) welcome();
  else if (state.test.supervised) await followRoom();
  else if (state.test.next === null) done();
  else await show(state.test.next);
}

async function attempt(action) {
  try {
    await action();
  } catch (error) {
    if (!(error instanceof Refused)) throw error;
    if (error.status === 404 && state.voter) { // the secret is of another time: begin as somebody new
      localStorage.removeItem(KEPT);
      state.voter = "";
      await attempt(begin);
    } else {
      say(h("p", { class: "bad" }, error.message));
    }
  }
}

attempt(begin);
