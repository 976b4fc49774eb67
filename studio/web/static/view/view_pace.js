// Inside the 3D view, before its own program: where WebGL is drawn by software, a picture is begun once the last one is done.
// Otherwise pictures queue up: the view lags more and more, and finally freezes for seconds, with the page.
(() => {
  const animate = window.requestAnimationFrame.bind(window);
  let calls = new Map(); // for the next picture, by their ids
  let last = 0; // id
  let fence = null; // of the picture that is being drawn
  let begun = 0; // pictures

  window.requestAnimationFrame = (call) => {
    if (calls.set(++last, call).size === 1) animate(turn);
    return last;
  };
  window.cancelAnimationFrame = (id) => { if (calls.has(id)) calls.set(id, () => {}); };

  function turn(time) {
    if (isDrawing()) {
      animate(turn);
      return;
    }
    const now = calls;
    calls = new Map();
    for (const call of now.values()) {
      try {
        call(time);
      } catch (error) {
        reportError(error);
      }
    }
    noteBegun();
  }

  function isDrawing() {
    const gl = fence && drawnBySoftware()?.renderer.getContext();
    if (!gl || gl.isContextLost()) return false;
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) === gl.UNSIGNALED) return true;
    gl.deleteSync(fence);
    fence = null;
    return false;
  }

  /** Set a fence if a picture was begun. */
  function noteBegun() {
    const renderer = drawnBySoftware()?.renderer;
    if (!renderer || renderer.info.render.frame === begun) return;
    begun = renderer.info.render.frame;
    const gl = renderer.getContext();
    if (fence) gl.deleteSync(fence);
    fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }
})();
