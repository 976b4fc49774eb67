// Inside the 3D view, before its own program: nothing is drawn while nothing changes. Its program draws after each message and
// also once a second, for changes that request no drawing; without a graphics card that keeps a processor busy.
(() => {
  const BEAT = "/beat"; // the node that moves twice a second, whatever is shown: only the page is told
  const HEARTBEAT_MS = 1000; // the interval in which viser draws in any case
  const AWAKE_MS = 2000; // it does for so long after a message: parts are loaded
  const native = window.setInterval.bind(window);
  let awakeUntil = Infinity; // until the first message: the program loads

  window.setInterval = (call, ms, ...values) => {
    if (ms !== HEARTBEAT_MS) return native(call, ms, ...values);
    return native(() => { if (performance.now() < awakeUntil) call(...values); }, ms);
  };

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", (event) => {
        const { type, messages } = event.data;
        if (type === "message_batch" && messages.every(({ name }) => name === BEAT)) event.stopImmediatePropagation();
        else awakeUntil = performance.now() + AWAKE_MS;
      });
    }
  };
})();
