// The events WebSocket: passes on messages, reports when the last one is too old, and reconnects.
import { answers } from "./api.js";
import { hear } from "./said.js";

/** Maximum age of a status that still counts as current [ms]. */
export const FRESH_MS = 2000;

/** Silence after which a connection is replaced by a new one [ms]. */
export const DEAD_MS = 6000;
const FIRST_RETRY_MS = 500;
const LAST_RETRY_MS = 1000; // a server that comes back is found again at once, and its view within 3 s

/** Follow the events of `url`; `onState` gets "connecting", "open" (the last message is fresh) or "gone". */
export function follow(url, { onMessage, onState }) {
  let state = "", retry = FIRST_RETRY_MS, socket = null, silence = 0;

  const become = (now) => {
    if (now !== state) onState(state = now);
  };

  const end = () => {
    clearTimeout(silence);
    socket = null;
    become("gone");
    setTimeout(again, retry);
    retry = Math.min(LAST_RETRY_MS, retry * 2);
  };

  /** Ask first: after many failed WebSockets, a browser delays the next by seconds. */
  async function again() {
    if (await answers(DEAD_MS)) open();
    else end();
  }

  const listen = (own) => {
    clearTimeout(silence);
    silence = setTimeout(() => {
      become("gone");
      silence = setTimeout(() => { own.close(); if (socket === own) end(); }, DEAD_MS - FRESH_MS);
    }, FRESH_MS);
  };

  function open() {
    const own = socket = new WebSocket(url);
    listen(own);
    own.addEventListener("close", () => { if (socket === own) end(); });
    own.addEventListener("message", (event) => {
      if (socket !== own) return;
      retry = FIRST_RETRY_MS;
      listen(own);
      become("open");
      onMessage(hear(JSON.parse(event.data)));
    });
  }

  become("connecting");
  open();
}
