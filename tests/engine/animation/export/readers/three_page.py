"""A GLB as three.js shows it in Chromium: its joints at given times, and a picture."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from playwright.sync_api import Page, Route

VENDOR = Path(__file__).parents[5] / "studio" / "web" / "static" / "vendor" / "three"
_SITE = "http://glb.test"
_PAGE = """<!doctype html><meta charset="utf-8"><style>body{margin:0}canvas{display:block}</style>
<script type="importmap">{"imports":{"three":"/three/three.module.js","three/addons/":"/three/addons/"}}</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
const gltf = await new GLTFLoader().loadAsync('/file.glb');
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xeceff3);
scene.add(gltf.scene, new THREE.HemisphereLight(0xffffff, 0x667788, 2.2));
const sun = new THREE.DirectionalLight(0xffffff, 2.0);
sun.position.set(2, 4, 3);
scene.add(sun, new THREE.GridHelper(6, 12, 0x99a3ad, 0xc3cad1));
const camera = new THREE.PerspectiveCamera(35, innerWidth / innerHeight, 0.05, 50);
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
const mixer = new THREE.AnimationMixer(gltf.scene);
const clip = gltf.animations[0];
mixer.clipAction(clip).play();
const skinned = [];
gltf.scene.traverse((node) => { if (node.isSkinnedMesh) skinned.push(node); });
window.about = { clip: clip.name, duration: clip.duration, skinned: skinned.length };
window.joints = (names, times) => times.map((time) => {
  mixer.setTime(time);
  gltf.scene.updateMatrixWorld(true);
  return names.map((name) => {
    const node = gltf.scene.getObjectByName(THREE.PropertyBinding.sanitizeNodeName(name));
    const p = new THREE.Vector3(), q = new THREE.Quaternion();
    node.matrixWorld.decompose(p, q, new THREE.Vector3());
    return [p.x, p.y, p.z, q.w, q.x, q.y, q.z];
  });
});
window.show = (time, from, at) => {
  mixer.setTime(time);
  camera.position.set(...from);
  camera.lookAt(...at);
  renderer.render(scene, camera);
};
window.ready = true;
</script>"""


@dataclass(frozen=True)
class ThreeFile:
    """A GLB that is open on a page."""

    page: Page
    about: dict[str, Any]

    def joints(self, names: tuple[str, ...], times_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return world positions [m] and wxyz rotations, shape (time_count, joint_count, 7)."""
        arguments = json.dumps(list(names)), json.dumps(list(map(float, times_s)))
        return np.array(self.page.evaluate(f"window.joints({arguments[0]}, {arguments[1]})"))

    def picture(self, time_s: float, *, eye_m: list[float], at_m: list[float]) -> bytes:
        """Return a PNG of the scene at one time."""
        self.page.evaluate(f"window.show({time_s}, {json.dumps(eye_m)}, {json.dumps(at_m)})")
        return self.page.screenshot()


def open_in_three(page: Page, path: Path) -> ThreeFile:
    """Open a GLB on a page, which can load only the vendored three.js and the file."""

    def answer(route: Route) -> None:
        url = route.request.url.removeprefix(_SITE)
        if url == "/":
            route.fulfill(body=_PAGE, content_type="text/html")
        elif url == "/file.glb":
            route.fulfill(body=path.read_bytes(), content_type="model/gltf-binary")
        elif url.startswith("/three/"):
            route.fulfill(path=VENDOR / url.removeprefix("/three/"), content_type="text/javascript")
        else:
            route.fulfill(status=204)

    page.route(f"{_SITE}/**", answer)
    page.goto(f"{_SITE}/")
    page.wait_for_function("window.ready === true", timeout=60_000)
    return ThreeFile(page, page.evaluate("window.about"))
