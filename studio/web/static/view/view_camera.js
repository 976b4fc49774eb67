// Inside the 3D view, before its own program: the page moves the camera, not the server, and gets reports of where it is,
// whether the user moved it, and what the page needs to choose a viewpoint.
(() => {
  const KEPT = "viewpoint"; // as viewpoint.js keeps it, for this tab
  const FRUSTUM = /^\/cameras\/.+\/frustum$/;
  const OPERATOR = ["/operator/from", "/operator/at", "/operator/page"]; // nodes whose positions are values
  const PLACE = /^\/places\/\d+$/;
  const MOVING_KEYS = ["KeyW", "KeyA", "KeyS", "KeyD", "KeyQ", "KeyE", "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"];
  const REST_MS = 400; // the camera comes to rest after the user has let go
  const kept = JSON.parse(sessionStorage.getItem(KEPT) ?? "{}").look;
  const first = { ...kept }; // the look that the view begins with
  const scene = {}; // what the page needs of it, by node

  let worker = null;
  let camera = null; // as the page was told last
  let order = 0; // the number of the page's last look
  let byHand = false; // the user moved the camera since
  let rest = 0;

  const tell = (message) => parent.postMessage(message, location.origin);

  function tellCamera() {
    if (camera && first.position && first.target) tell({ type: "camera", ...camera, first, byHand, order });
  }

  /** Let the camera begin where this tab's was, and report to the page what is new in the scene. */
  function hear({ data }) {
    const told = {};
    for (const message of data.type === "message_batch" ? data.messages : []) {
      if (message.initial && message.type === "SetCameraPositionMessage") message.position = first.position = kept?.position ?? message.position;
      if (message.initial && message.type === "SetCameraLookAtMessage") message.look_at = first.target = kept?.target ?? message.look_at;
      if (!FRUSTUM.test(message.name) && !PLACE.test(message.name) && !OPERATOR.includes(message.name)) continue;
      if (message.type === "SetPositionMessage") told[message.name] = [...message.position];
      if (message.type === "RemoveSceneNodeMessage") told[message.name] = null;
    }
    Object.assign(scene, told);
    if (OPERATOR.some((name) => name in told)) for (const name of OPERATOR) told[name] = scene[name];
    if (Object.keys(told).length) tell({ type: "scene", told });
  }

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      worker = this;
      this.addEventListener("message", hear);
    }

    postMessage(data, ...rest) {
      const { message } = data;
      if (message?.type === "ViewerCameraMessage") {
        camera = { position: message.position, target: message.look_at, aspect: message.image_width / message.image_height };
        tellCamera();
      }
      super.postMessage(data, ...rest);
    }
  };

  function look(wanted) {
    ({ order } = wanted);
    byHand = false;
    const messages = [
      { type: "SetCameraPositionMessage", position: wanted.position, initial: false }, { type: "SetCameraLookAtMessage", look_at: wanted.target, initial: false },
    ];
    worker?.dispatchEvent(new MessageEvent("message", { data: { type: "message_batch", messages } })); // none yet: the page says it again
  }

  window.addEventListener("message", ({ origin, data }) => {
    if (origin !== location.origin) return;
    if (data?.type === "look") look(data);
    if (data?.type !== "hello") return;
    tell({ type: "scene", told: scene }); // to a page that was not there yet
    tellCamera();
  });

  /** Report when the user holds the camera, and when it is at rest again. */
  function hold(lasting) {
    clearTimeout(rest);
    tell({ type: "holding", holding: true });
    if (!lasting) rest = setTimeout(() => tell({ type: "holding", holding: false }), REST_MS);
  }

  const quietly = { capture: true, passive: true };
  window.addEventListener("pointerdown", () => hold(true), quietly);
  for (const name of ["pointerup", "pointercancel", "blur"]) window.addEventListener(name, () => hold(false), quietly);
  window.addEventListener("pointermove", ({ buttons }) => { byHand ||= buttons > 0; }, quietly);
  window.addEventListener("wheel", () => { byHand = true; hold(false); }, quietly);
  window.addEventListener("keydown", ({ code }) => { if (MOVING_KEYS.includes(code)) { byHand = true; hold(false); } }, quietly);
  tell({ type: "begun" });
})();
