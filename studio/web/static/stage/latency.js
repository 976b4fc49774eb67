// How old a pose is when it reaches this browser: from the cameras' capture to the WebSocket's message, on one clock.
import { getClock } from "../base/api.js";
import { byId, setText } from "../base/dom.js";
import { FRESH_MS } from "../base/events.js";
import { number, t } from "../base/strings.js";

const KEPT_S = 10; // poses that the figures are of
const FEWEST = 20;
const FIRST_EXCHANGES = 8;
const FIRST_MS = 250;
const EXCHANGE_MS = 15_000;
const LAST_RETRY_MS = 60_000;
const EXCHANGES = 12; // three minutes of them, so that a clock that drifts is followed
const SHOW_MS = 500;
const GOAL_MS = 80;

const now = () => (performance.timeOrigin + performance.now()) / 1000;
const state = { exchanges: [], asked: 0, poses: [], pictures: [], round: 0 };

/** Ask for the server's time; the quickest of several answers is the most accurate. */
async function exchange() {
  const { server_s: server, sent_ms: sent, received_ms: received } = await getClock(state.asked += 1);
  const halfway = (performance.timeOrigin + (sent + received) / 2) / 1000;
  state.exchanges.push({ offset: server - halfway, trip: (received - sent) / 1000 });
  if (state.exchanges.length > EXCHANGES) state.exchanges.shift();
}

/** Return the wait before the next exchange [ms], after `failed` failures in a row. */
function pause(failed) {
  if (failed) return Math.min(LAST_RETRY_MS, 1000 * 2 ** (failed - 1));
  return state.exchanges.length < FIRST_EXCHANGES ? FIRST_MS : EXCHANGE_MS;
}

/** Exchange times while the page is visible. */
async function keepExchanging(round, failed = 0) {
  if (round !== state.round) return;
  if (document.hidden) {
    document.addEventListener("visibilitychange", () => keepExchanging(round), { once: true });
    return;
  }
  try {
    await exchange();
    failed = 0;
  } catch {
    state.exchanges = []; // the server is gone: another one may answer, with another clock
    failed += 1;
  }
  setTimeout(keepExchanging, pause(failed), round, failed);
}

/** Restart the measurement: the server is there (again), perhaps another one with another clock. */
export function measureAnew() {
  state.exchanges = [];
  keepExchanging(state.round += 1);
}

const best = () => state.exchanges.reduce((a, b) => (b.trip < a.trip ? b : a));

/** Return the value that a share of the values does not exceed. */
export function quantile(values, share) {
  const sorted = values.toSorted((a, b) => a - b);
  return sorted[Math.min(sorted.length - 1, Math.ceil(share * sorted.length) - 1)];
}

/** Latencies of the last seconds [ms], to the message and from there to the screen; null before there are enough. */
export function figures() {
  const since = now() - KEPT_S;
  state.poses = state.poses.filter((pose) => pose.came > since);
  state.pictures = state.pictures.filter(({ shown }) => shown > since);
  const newest = state.poses.at(-1)?.came ?? 0;
  if (now() - newest > FRESH_MS / 1000 || state.poses.length < FEWEST || state.exchanges.length < FIRST_EXCHANGES) return null;
  const { offset, trip } = best();
  const message = state.poses.map(({ came, captured }) => 1000 * (came + offset - captured));
  const server = state.poses.map(({ drawn, captured }) => 1000 * (drawn - captured));
  const screen = state.pictures.map(({ came, shown }) => 1000 * (shown - came));
  return {
    median: quantile(message, 0.5), p95: quantile(message, 0.95), server_p95: quantile(server, 0.95),
    screen_p95: screen.length ? quantile(screen, 0.95) : null, sure: 500 * trip, poses: message.length,
  };
}

function show() {
  const found = figures();
  const shown = byId("latency");
  shown.hidden = !found;
  if (!found) return;
  const ms = (value) => number(value);
  setText(shown.querySelector(".value"), t("latency.value", { ms: ms(found.median), p95: ms(found.p95) }));
  setText(shown.querySelector(".screen"), found.screen_p95 === null ? "" : t("latency.screen", { ms: ms(found.screen_p95) }));
  shown.title = t("latency.hint", { server: ms(found.server_p95), sure: number(found.sure, 1) });
  shown.classList.toggle("fair", found.p95 > GOAL_MS);
}

/** Measure poses from now on, and clocks once `measureAnew` says that the server is there. */
export function startLatency() {
  window.addEventListener("message", ({ origin, data }) => {
    if (origin !== location.origin) return;
    if (data?.type === "pose") state.poses.push(data);
    if (data?.type === "shown") state.pictures.push(data);
  });
  setInterval(show, SHOW_MS);
}
