// What a page shows once it no longer knows: of a status that is too old only what does not change by itself, and how old
// the picture of the 3D view is. The age of the status itself is known to `events.js`.
import { byId } from "./dom.js";
import { DEAD_MS, FRESH_MS } from "./events.js";

const LOADING_MS = 15_000; // a view that is being loaded has no picture yet
const CHECK_MS = 250;
const SETTLED_MS = 500; // when a server ends, its links end one after the other
const NOTHING = {
  state: "unknown", connected: false, limited_by: "", reason: "", fps: null, latency_ms: null, jitter_ms: null, loss_percent: null, confidence: null,
};

const TONES = { live: "good", trouble: "fair", silent: "bad", gone: "bad" };

/** The tone of a camera's state; that of one of which nothing is known is neither good nor bad. */
export const toneOf = (camera) => TONES[camera.state] ?? "muted";

/** Return a status as it stands when nothing is known of now: `stale`, its cameras in state "unknown". */
export const unknown = (status) => ({
  ...status,
  stale: true,
  cameras: Object.fromEntries(Object.entries(status.cameras).map(([name, camera]) => [name, { ...camera, ...NOTHING }])),
});

/** Return a time of day, as `toLocaleTimeString` has it, of so many ms ago. */
export const timeOfDay = (language, ago = 0) => new Date(Date.now() - ago).toLocaleTimeString(language);

/**
 * Watch the picture of the 3D view, which says twice a second that it is of now; `onChange` hears when it no longer is
 * (`performance.now()` of the last time) or is again (null). A view whose link has ended, or that is silent for long, is
 * loaded anew once the server is `reachable()`: what is left of its own scene does not take in another server's. One that
 * is late for a moment, on a busy machine, stays: loading it would take longer, and clicks in it would be lost. While the
 * page itself stands still, as at the first pictures without a graphics card, nobody is silent.
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
