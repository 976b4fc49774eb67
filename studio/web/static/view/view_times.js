// Inside the 3D view, before its own program: reports to the page when a pose came by the WebSocket and when it was shown,
// that its picture is current, and that its link has ended.
(() => {
  const CLOCK = "/clock"; // the node whose position is [captured, drawn, 0], s on the server's clock
  const BEAT = "/beat"; // the node that moves twice a second, whatever is shown
  const POINTS = "/points/"; // nodes of the depth cameras' points, by camera
  const now = () => (performance.timeOrigin + performance.now()) / 1000;
  const tell = (message) => parent.postMessage(message, location.origin);

  // Runs in the view's worker, which has its WebSocket: notes when a message came, and adds that to the decoded message.
  function noteArrivals() {
    const arrivals = [];
    self.WebSocket = class extends WebSocket {
      constructor(...how) {
        super(...how);
        arrivals.length = 0;
        this.addEventListener("message", () => arrivals.push((performance.timeOrigin + performance.now()) / 1000));
      }
    };
    const post = self.postMessage.bind(self);
    self.postMessage = (data, ...rest) => {
      if (data.type === "message_batch") data.came = arrivals.shift();
      post(data, ...rest);
    };
  }

  const script = (text) => URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
  const before = script(`(${noteArrivals})();`);

  // viser reconnects only while its frame has the focus, which is rare on this page, and then fails on the rest of its
  // scene. Here it never reconnects: the page reloads it once the server answers.
  document.hasFocus = () => false;

  // Report the points in a message: by camera how many it has now (0: none any more), and how many bytes arrived.
  function tellPoints({ messages, came }) {
    const counts = {};
    let bytes = 0;
    for (const { type, name, props, updates } of messages) {
      if (!name?.startsWith(POINTS)) continue;
      const { points, colors } = props ?? updates ?? {};
      if (type === "RemoveSceneNodeMessage") counts[name.slice(POINTS.length)] = 0;
      if (!points) continue;
      counts[name.slice(POINTS.length)] = points.length / 3;
      bytes += points.byteLength + (colors?.byteLength ?? 0);
    }
    if (Object.keys(counts).length) tell({ type: "points", counts, bytes, came: came ?? now() });
  }

  function hear({ data }) {
    if (data.type === "closed") tell({ type: "closed" });
    if (data.type !== "message_batch") return;
    if (data.messages.some((message) => message.name === BEAT)) tell({ type: "beat" });
    tellPoints(data);
    const times = data.messages.findLast((message) => message.type === "SetPositionMessage" && message.name === CLOCK);
    if (!times) return;
    const [captured, drawn] = times.position;
    const came = data.came ?? now();
    tell({ type: "pose", captured, drawn, came });
    // The scene is drawn in the next animation frame; when the one after it begins, that picture was handed over.
    requestAnimationFrame(() => requestAnimationFrame(() => tell({ type: "shown", came, shown: now() })));
  }

  window.Worker = class extends Worker {
    constructor(address, how) {
      super(how?.type === "module" ? script(`import "${before}"; import "${address}";`) : address, how);
      this.addEventListener("message", hear);
    }
  };
})();
