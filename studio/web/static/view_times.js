// Inside the 3D view, before its own program: tells the page when a pose came by the WebSocket and when it was shown.
(() => {
  const CLOCK = "/clock"; // the node whose position is [captured, drawn, 0], s on the server's clock
  const now = () => (performance.timeOrigin + performance.now()) / 1000;

  function came([captured, drawn], at) {
    // The scene is drawn in the next animation frame; when the one after it begins, that picture was handed over.
    requestAnimationFrame(() => requestAnimationFrame(() => {
      parent.postMessage({ type: "pose", captured, drawn, came: at, shown: now() }, location.origin);
    }));
  }

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", ({ data }) => {
        if (data.type !== "message_batch") return;
        const at = now();
        const times = data.messages.findLast((message) => message.type === "SetPositionMessage" && message.name === CLOCK);
        if (times) came(times.position, at);
      });
    }
  };
})();
