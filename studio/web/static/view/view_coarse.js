// Inside the 3D view: bodies with a third of their triangles, for moving pictures of few pixels, which cost software mostly triangles.
// Vertices of one bone within a cell, on one side of the surface, are merged into one of them, with its place, shade and bones.
(() => {
  const CELL_M = 0.04;
  const NEAR_M = 2.5; // a body that is nearer to the camera than this stays as it is
  const coarse = new WeakMap(), fine = new WeakMap(); // geometry by geometry

  /** Make a scene's distant bodies coarse if `mayBeCoarse`, and all others fine. */
  window.drawCoarsely = (scene, camera, mayBeCoarse) => scene.traverseVisible((body) => {
    if (!body.isSkinnedMesh) return;
    const isCoarse = mayBeCoarse && distance(camera, body.skeleton.bones[0]) > NEAR_M, { geometry } = body;
    if (fine.has(geometry) === isCoarse) return;
    if (isCoarse && !coarse.has(geometry)) {
      coarse.set(geometry, coarsened(geometry));
      fine.set(coarse.get(geometry), geometry);
    }
    body.geometry = (isCoarse ? coarse : fine).get(geometry);
  });

  const distance = (a, b) => Math.hypot(...[12, 13, 14].map((k) => a.matrixWorld.elements[k] - b.matrixWorld.elements[k]));

  function coarsened(geometry) {
    const { attributes, index } = geometry, near = neighbours(attributes);
    const corners = [];
    for (let i = 0; i < index.count; i += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => near[index.array[i + k]]);
      if (a !== b && b !== c && c !== a) corners.push(a, b, c);
    }
    const made = new geometry.constructor();
    for (const [name, values] of Object.entries(attributes)) made.setAttribute(name, values);
    made.setIndex(corners);
    made.boundingSphere = geometry.boundingSphere;
    made.boundingBox = geometry.boundingBox;
    return made;
  }

  /** Return for each vertex the one that represents its cell. */
  function neighbours({ position, normal, skinIndex, skinWeight }) {
    const chosen = new Map(), near = new Uint32Array(position.count);
    for (let i = 0; i < position.count; i += 1) {
      const weights = [0, 1, 2, 3].map((k) => skinWeight.array[4 * i + k]);
      const bone = skinIndex.array[4 * i + weights.indexOf(Math.max(...weights))];
      const place = [0, 1, 2].map((k) => [Math.floor(position.array[3 * i + k] / CELL_M), normal.array[3 * i + k] > 0]);
      const cell = String([bone, place]);
      if (!chosen.has(cell)) chosen.set(cell, i);
      near[i] = chosen.get(cell);
    }
    return near;
  }
})();
