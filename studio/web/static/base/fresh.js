// What a page shows once its data is outdated: of an old status only what does not change by itself, and the age of
// the 3D view's picture. `events.js` watches the age of the status itself.
import { byId } from "./dom.js";
import { DEAD_MS, FRESH_MS } from "./events.js";

const LOADING_MS = 15_000; // a view that is being loaded has no picture yet
const CHECK_MS = 250;
const SETTLED_MS = 500; // when a server ends, its links end one after the other
const NOTHING = {
  state: "unknown", connected: false, limited_by: "", reason: "", fps: null, latency_ms: null, jitter_ms: null, loss_percent: null, confidence: null,
};

const TONES = { live: "good", trouble: "fair", silent: "bad", gone: "bad" };

/** Return the tone of a camera's state; an unknown state is neither good nor bad. */
export const toneOf = (camera) => TONES[camera.state] ?? "muted";

/** Return a status for when the current state is unknown: `stale`, its cameras in state "unknown". */
export const unknown = (status) => ({
  ...status,
  stale: true,
  cameras: Object.fromEntries(Object.entries(status.cameras).map(([name, camera]) => [name, { ...camera, ...NOTHING }])),
});

/** Return the time of day `ago` ms ago, as formatted by `toLocaleTimeString`. */
export const timeOfDay = (language, ago = 0) => new Date(Date.now() - ago).toLocaleTimeString(language);

/**
 * Watch the picture of the 3D view, which reports twice a second that it is current. `onChange` is called when it no longer
 * is (with `performance.now()` of the last report) or is again (null). A view that lost its connection, or has long been
 * silent, is reloaded once the server is `reachable()`: its old scene cannot take in that of another server. A view that is
 * only briefly late, on a busy machine, stays: reloading would take longer and lose clicks in it. Time in which the page
 * itself stands still, as during the first pictures without a graphics card, does not count as silence.
 */
export function watchPicture(onChange, reachable) {
  let heard = performance.now() + LOADING_MS - FRESH_MS, loaded = -Infinity, staleFrom = null, ended = false;
  let checked = performance.now(), silentMs = 0;
  const check = () => {
    const now = performance.now(), old = now - heard > FRESH_MS;
    silentMs += Math.min(now - checked, 2 * CHECK_MS);
    checked = now;
    if (old !== (staleFrom !== null)) {
      staleFrom = old ? now : null;
      onChange(old ? heard : null);
    }
    if (!reachable()) loaded = -Infinity;
    else if (old && (ended ? now - staleFrom > SETTLED_MS : silentMs > DEAD_MS) && now - loaded > LOADING_MS) {
      loaded = now;
      byId("viewer").src = byId("viewer").src;
    }
  };
  window.addEventListener("message", ({ origin, data }) => {
    if (origin !== location.origin) return;
    if (data?.type === "beat") [heard, ended, silentMs] = [performance.now(), false, 0];
    else if (data?.type === "closed") [heard, ended] = [Math.min(heard, performance.now() - FRESH_MS - 1), true];
    else return;
    check();
  });
  setInterval(check, CHECK_MS);
}
