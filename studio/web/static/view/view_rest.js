// Inside the 3D view, before its own program: it draws while something changes, and rests otherwise. Its program draws the
// scene anew in every animation frame, changed or not, which keeps a processor busy where there is no graphics card.
(() => {
  const BEAT = "/beat"; // the node that moves twice a second, whatever is shown; the scene is drawn once then
  const AWAKE_MS = 2000; // so long after a change: parts are loaded, movements of the camera end
  const CHANGES = ["pointerdown", "pointermove", "pointerup", "wheel", "touchstart", "touchmove", "keydown", "keyup"];
  const OF_WINDOW = ["resize", "focus", "message"];
  const native = window.requestAnimationFrame.bind(window);
  const waiting = new Map(); // number -> what is called in the next frame
  let last = 0;
  let asked = false;
  let awakeUntil = Infinity; // until the first change: the program loads

  function frame(time) {
    asked = false;
    for (const number of [...waiting.keys()]) {
      const call = waiting.get(number);
      if (!waiting.delete(number)) continue; // given up by one before it
      try {
        call(time);
      } catch (error) {
        reportError(error);
      }
    }
    if (performance.now() < awakeUntil) draw();
  }

  function draw() {
    if (asked || waiting.size === 0) return;
    asked = true;
    native(frame);
  }

  function wake() {
    awakeUntil = performance.now() + AWAKE_MS;
    draw();
  }

  window.requestAnimationFrame = (call) => {
    waiting.set(++last, call);
    if (performance.now() < awakeUntil) draw();
    return last;
  };
  window.cancelAnimationFrame = (number) => void waiting.delete(number);

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", ({ data }) => {
        const messages = data.type === "message_batch" ? data.messages : null;
        if (messages?.every(({ name }) => name === BEAT)) draw();
        else wake();
      });
    }
  };
  for (const name of CHANGES) window.addEventListener(name, wake, { capture: true, passive: true });
  for (const name of OF_WINDOW) window.addEventListener(name, wake);
})();
