// The events WebSocket: hands over messages, says whether the server is there, and reconnects.
const FIRST_RETRY_MS = 500;
const LAST_RETRY_MS = 4000;

/** Open the events of `url`; `onState` hears "connecting", "open" or "gone". */
export function follow(url, { onMessage, onState }) {
  let retry = FIRST_RETRY_MS;
  const open = () => {
    const socket = new WebSocket(url);
    let wasOpen = false;
    socket.addEventListener("open", () => { wasOpen = true; retry = FIRST_RETRY_MS; onState("open"); });
    socket.addEventListener("message", (event) => onMessage(JSON.parse(event.data)));
    socket.addEventListener("close", () => {
      onState("gone");
      setTimeout(open, wasOpen ? FIRST_RETRY_MS : retry);
      retry = Math.min(LAST_RETRY_MS, retry * 2);
    });
  };
  onState("connecting");
  open();
}
