// Inside the 3D view, before its own program: where WebGL is drawn by software, the picture has fewer pixels while something
// moves, as many as keep it fluent, and more than the screen at rest, which smooths its edges. With a graphics card nothing
// changes. Multisampling, which otherwise smooths the view's edges, costs software as much as the picture itself.
// `view_pace.js` and `view_coarse.js` save more where WebGL is drawn by software.
(() => {
  const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
  const SCALES = [1, 0.8, 0.65, 0.5]; // of the screen's pixels, by side, while something moves
  const COARSE = 2; // of SCALES: from here on bodies have fewer triangles, which so few pixels do not show
  const FEWEST = 22; // pictures a second: fewer, and the next one has fewer pixels
  const PLENTY = 30; // so many, and it could have more
  const SHARP = 2; // of the screen's pixels, by side, at rest, for a length of 1 in CSS at most as many
  const SHARP_PIXELS = 2e6; // more than the screen's are no more than so many: a picture takes software half a second
  const WINDOW_MS = 500; // pictures are counted for so long
  const REST_MS = 500; // without news for so long, the view is at rest
  const LOOK_MS = 250;
  const DOWN = 2, UP = 6; // windows in a row, of too few or of plenty of pictures, until it has fewer pixels, or more
  const AGAIN_MS = 30_000; // what was too much is not tried again for so long
  const LINES = ["cellThickness", "sectionThickness"]; // of the floor's grid [px]

  let software = null; // unknown until the view asks for its canvas
  let level = 0; // of SCALES
  let setRatio = null; // of the renderer
  let news = -Infinity; // when something changed last
  let timer = 0;
  let windowBegan = 0, counted = 0, few = 0, plenty = 0, tooMuch = -Infinity;
  let sharp = false;
  const thickness = new WeakMap(); // a grid's material -> its lines' thickness in a picture of the screen's pixels
  const { getContext } = HTMLCanvasElement.prototype;

  function isSoftware() {
    const gl = getContext.call(document.createElement("canvas"), "webgl2");
    const named = gl?.getExtension("WEBGL_debug_renderer_info");
    const name = gl?.getParameter(named?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER) ?? "";
    gl?.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(name);
  }

  HTMLCanvasElement.prototype.getContext = function context(kind, how) {
    if (!kind.startsWith("webgl") || !how?.antialias) return getContext.call(this, kind, how);
    software ??= isSoftware();
    if (software) tell();
    return getContext.call(this, kind, { ...how, antialias: !software });
  };

  function tell() {
    parent.postMessage({ type: "resolution", scale: SCALES[level] }, location.origin);
  }

  /** viser's scene, camera and renderer, once they are there and drawn by software; else null. */
  window.drawnBySoftware = function drawn() {
    const { scene, camera } = window.__viserMutable ?? {};
    const renderer = scene?.__r3f?.root?.getState().gl;
    if (!software || !renderer || !camera) return null;
    if (!setRatio) {
      setRatio = renderer.setPixelRatio.bind(renderer);
      renderer.setPixelRatio = () => {}; // viser's own choice, of how many pixels a graphics card manages
    }
    return { scene, camera, renderer };
  };

  function sharpRatio({ clientWidth, clientHeight }) {
    return Math.max(devicePixelRatio, Math.min(SHARP, SHARP * devicePixelRatio, Math.sqrt(SHARP_PIXELS / (clientWidth * clientHeight))));
  }

  function draw() {
    const view = drawnBySoftware();
    const ratio = view && (sharp ? sharpRatio(view.renderer.domElement) : SCALES[level] * devicePixelRatio);
    if (view) drawCoarsely(view.scene, view.camera, !sharp && level >= COARSE);
    if (!view || view.renderer.getPixelRatio() === ratio) return;
    setRatio(ratio);
    view.scene.traverse(({ material }) => { if (material?.uniforms?.cellThickness) drawLines(material, ratio / devicePixelRatio); });
    view.renderer.render(view.scene, view.camera); // at once: a canvas of another size is empty
  }

  /** Keep the lines of a grid equally dark: their shader counts pixels of the picture. */
  function drawLines(material, scale) {
    if (!thickness.has(material)) thickness.set(material, LINES.map((name) => material.uniforms[name].value));
    LINES.forEach((name, i) => { material.uniforms[name].value = thickness.get(material)[i] * Math.sqrt(scale); });
  }

  function beginWindow() {
    windowBegan = performance.now();
    counted = drawnBySoftware()?.renderer.info.render.frame ?? 0;
  }

  /** Choose the resolution by the number of pictures drawn in the window that ends. */
  function judge() {
    const view = drawnBySoftware();
    if (!view || document.hidden) return;
    const now = performance.now();
    const rate = (1000 * (view.renderer.info.render.frame - counted)) / (now - windowBegan);
    few = rate < FEWEST ? few + 1 : 0;
    plenty = rate > PLENTY && now - tooMuch > AGAIN_MS ? plenty + 1 : 0;
    if (few < DOWN && plenty < UP) return;
    if (few) tooMuch = now;
    level = Math.max(0, Math.min(SCALES.length - 1, level + (few ? 1 : -1)));
    few = plenty = 0;
    tell();
  }

  function look() {
    const since = performance.now() - news;
    if (since < REST_MS) {
      if (performance.now() - windowBegan >= WINDOW_MS) {
        judge();
        beginWindow();
      }
      draw();
      timer = setTimeout(look, LOOK_MS);
      return;
    }
    timer = 0;
    sharp = true;
    draw();
  }

  function wake() {
    if (software === false) return;
    news = performance.now();
    if (timer) return;
    timer = setTimeout(look, LOOK_MS);
    sharp = false;
    draw();
    beginWindow();
  }

  window.Worker = class extends Worker {
    constructor(...how) {
      super(...how);
      this.addEventListener("message", ({ data }) => {
        if (data.type === "message_batch") wake();
      });
    }
  };
  const quietly = { capture: true, passive: true };
  for (const name of ["pointerdown", "wheel", "touchmove", "keydown"]) window.addEventListener(name, wake, quietly);
  window.addEventListener("pointermove", ({ buttons }) => { if (buttons) wake(); }, quietly);
})();
