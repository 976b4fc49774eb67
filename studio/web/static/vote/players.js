// Animations on canvases: one clock and one camera for all, so that they play in step and turn together.
import * as THREE from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { ContactShadows } from "./contact.js";

const GROUND = 0xe6e9ed;
const MAX_RATIO = 1.5; // pixels per CSS pixel: enough to judge motion
const MIN_RATIO = 0.5; // what a machine without a graphics card goes down to
const SLOW_MS = 45; // frames that take longer are drawn with fewer pixels
const FRAMES = 12; // over so many
const LOOK_HEIGHT = 0.9;
const VIEW_FROM = new THREE.Vector3(0.8, 0.5, 3.9);
const SOFTNESS = 0.06;
const NEAR_M = 0.001; // a step that nobody sees: the view has arrived
const HIPS = /^Hips(_\d+)?$/; // of further performers in the file they are numbered

class Stage {
  constructor(canvas, gltf) {
    this.canvas = canvas;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.scene = new THREE.Scene();
    this.scene.background = new THREE.Color(GROUND);
    this.scene.add(new THREE.HemisphereLight(0xffffff, 0x9aa4af, 2.4));
    const sun = new THREE.DirectionalLight(0xffffff, 1.6);
    sun.position.set(2, 5, 3);
    this.scene.add(sun, new THREE.GridHelper(8, 16, 0xaab2bc, 0xcdd3da), gltf.scene);
    gltf.scene.traverse((node) => { node.frustumCulled = false; });
    this.mixer = new THREE.AnimationMixer(gltf.scene);
    this.duration = gltf.animations[0].duration;
    this.mixer.clipAction(gltf.animations[0]).play();
    this.contact = new ContactShadows(this.scene, gltf.scene);
    this.hips = [];
    gltf.scene.traverse((node) => { if (HIPS.test(node.name)) this.hips.push(node); });
  }

  draw(camera, seconds, ratio) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const size = this.renderer.getSize(new THREE.Vector2());
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    if (size.x !== width || size.y !== height) this.renderer.setSize(width, height, false);
    camera.aspect = width / Math.max(height, 1);
    camera.updateProjectionMatrix();
    this.mixer.setTime(Math.min(seconds, this.duration - 1e-4));
    this.contact.draw();
    this.renderer.render(this.scene, camera);
  }
}

export class Players {
  /** Return players of GLB files, one per canvas, playing; `listen(share, playing, seconds, duration)` gets their position. */
  static async open(canvases, files, listen) {
    const loader = new GLTFLoader();
    const loaded = await Promise.all(files.map((file) => loader.parseAsync(file, "")));
    return new Players(canvases.map((canvas, i) => new Stage(canvas, loaded[i])), listen);
  }

  constructor(stages, listen) {
    this.stages = stages;
    this.listen = listen;
    this.duration = Math.min(...stages.map((stage) => stage.duration));
    this.seconds = 0;
    this.speed = 1;
    this.playing = true;
    this.loop = true;
    this.following = true;
    this.drawn = 0;
    this.shown = "";
    this.measured = null;
    this.timed = 0;
    this.ratio = Math.min(window.devicePixelRatio, MAX_RATIO);
    this.camera = new THREE.PerspectiveCamera(36, 1, 0.05, 60);
    this.target = this.middle();
    this.camera.position.copy(this.target).add(VIEW_FROM);
    this.controls = stages.map((stage) => new OrbitControls(this.camera, stage.canvas));
    for (const controls of this.controls) {
      controls.target.copy(this.target);
      controls.addEventListener("change", () => {
        for (const other of this.controls) if (other !== controls) other.target.copy(controls.target);
      });
      controls.update();
    }
    for (const stage of stages) {
      stage.canvas.addEventListener("webglcontextrestored", () => { this.shown = ""; });
    }
    this.last = performance.now();
    this.running = true;
    requestAnimationFrame((now) => this.step(now));
  }

  step(now) {
    if (!this.running) return;
    if (this.playing) this.advance(((now - this.last) / 1000) * this.speed);
    this.last = now;
    if (this.following) this.follow();
    if (this.changes()) this.draw(now);
    else this.measured = null;
    this.listen(this.seconds / this.duration, this.playing, this.seconds, this.duration);
    requestAnimationFrame((next) => this.step(next));
  }

  /** Whether the picture differs from the last one: while nothing moves, a phone rests. */
  changes() {
    const { position, quaternion } = this.camera;
    const sizes = this.stages.flatMap(({ canvas }) => [canvas.clientWidth, canvas.clientHeight]);
    const shown = [this.seconds, this.ratio, ...position, ...quaternion, ...sizes].join();
    if (shown === this.shown) return false;
    this.shown = shown;
    return true;
  }

  draw(now) {
    this.adapt(now);
    for (const stage of this.stages) stage.draw(this.camera, this.seconds, this.ratio);
    this.drawn += 1;
    document.body.dataset.drawn = String(this.drawn);
  }

  /** Advance by a time [s]: in a loop, or up to the end. */
  advance(seconds) {
    const next = this.seconds + seconds;
    if (next >= this.duration && !this.loop) this.playing = false;
    this.seconds = this.playing ? next % this.duration : this.duration;
  }

  /** Draw fewer pixels where the machine is slow: steady motion is judged here, not sharpness. */
  adapt(now) {
    this.timed = this.measured === null ? 0 : this.timed + 1;
    if (this.timed % FRAMES !== 0) return;
    const took = (now - this.measured) / FRAMES;
    this.measured = now;
    if (this.timed > 0 && took > SLOW_MS) this.ratio = Math.max(this.ratio * 0.8, MIN_RATIO);
  }

  /** Follow the middle between the performers, so that none walks out of the picture. */
  follow() {
    const middle = this.middle();
    const shift = middle.clone().sub(this.target);
    if (shift.length() > NEAR_M) shift.multiplyScalar(SOFTNESS);
    this.target.add(shift);
    this.camera.position.add(shift);
    for (const controls of this.controls) controls.target.add(shift);
  }

  middle() {
    const sum = new THREE.Vector3(), all = this.stages.flatMap((stage) => stage.hips);
    for (const hips of all) sum.add(hips.getWorldPosition(new THREE.Vector3()));
    return sum.divideScalar(all.length).setY(LOOK_HEIGHT);
  }

  /** Play or pause; at the end, play begins again. */
  toggle() {
    this.playing = !this.playing;
    if (this.playing && this.seconds >= this.duration) this.seconds = 0;
  }

  /** Pause at a share of the duration, 0 to 1. */
  seek(share) {
    this.playing = false;
    this.seconds = Math.min(Math.max(share, 0), 1) * this.duration;
  }

  dispose() {
    this.running = false;
    for (const controls of this.controls) controls.dispose();
    for (const stage of this.stages) stage.renderer.dispose();
  }
}
