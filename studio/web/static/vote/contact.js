// Contact shadows: soft dark spots on the floor under heels and balls of the feet, the smaller the higher these are.
import * as THREE from "three";

const JOINTS = /^(Left|Right)(Foot|ToeBase)(_\d+)?$/; // of further performers they are numbered
const LIFTED = 0.12; // m: a foot that is lifted so far has none
const RADIUS = 0.105;
const OVER_FLOOR = 0.003;
const DARKEST = 0.5;
const PIXELS = 64;

function spot() {
  const canvas = Object.assign(document.createElement("canvas"), { width: PIXELS, height: PIXELS });
  const context = canvas.getContext("2d");
  const shade = context.createRadialGradient(PIXELS / 2, PIXELS / 2, 0, PIXELS / 2, PIXELS / 2, PIXELS / 2);
  for (let i = 0; i <= 8; i++) shade.addColorStop(i / 8, `rgba(0, 0, 0, ${DARKEST * (1 - (i / 8) ** 2) ** 2})`);
  context.fillStyle = shade;
  context.fillRect(0, 0, PIXELS, PIXELS);
  return new THREE.CanvasTexture(canvas);
}

/** Return the heights of the skeleton's joints in the bind pose, by name. */
function standing(root) {
  const heights = {};
  root.traverse(({ skeleton }) => skeleton?.bones.forEach((bone, i) => {
    heights[bone.name] = new THREE.Vector3().setFromMatrixPosition(skeleton.boneInverses[i].clone().invert()).y;
  }));
  return heights;
}

export class ContactShadows {
  /** Spots for the performers below `root`, in a scene whose floor is y = 0. */
  constructor(scene, root) {
    const heights = standing(root), map = spot();
    const joints = [];
    root.traverse((node) => { if (JOINTS.test(node.name)) joints.push(node); });
    this.spots = joints.map((joint) => ({ joint, height: heights[joint.name] })).filter(({ height }) => height !== undefined)
      .map(({ joint, height }) => {
        const mesh = new THREE.Mesh(new THREE.PlaneGeometry(2, 2), new THREE.MeshBasicMaterial({ map, transparent: true, depthWrite: false }));
        mesh.rotation.x = -Math.PI / 2;
        scene.add(mesh);
        return { joint, height, mesh };
      });
    this.place = new THREE.Vector3();
  }

  /** Move the spots to where the joints are now. */
  draw() {
    for (const { joint, height, mesh } of this.spots) {
      const { x, y, z } = joint.getWorldPosition(this.place);
      const share = Math.min(Math.max(1 - (y - height) / LIFTED, 0), 1);
      mesh.visible = share > 0.01;
      mesh.position.set(x, OVER_FLOOR, z);
      mesh.scale.setScalar(RADIUS * Math.max(share * share * (3 - 2 * share), 1e-3));
    }
  }
}
