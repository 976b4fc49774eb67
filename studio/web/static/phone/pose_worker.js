// Finds the landmarks of bodies in pictures, in a thread of its own, so that the page and the link do not wait.
//
// It receives {kind: "load", model, hands} and {kind: "frame", picture, at_ms}, one at a time, and answers each with
// {kind: "loaded" | "found" | "failed", ...}. Landmarks are as MediaPipe gives them: shares of the picture.
import { Hands } from "./hands.js";
import { PoseLandmarker } from "../vendor/tasks_vision/vision_bundle.mjs";
import { nearest } from "./people.js";

const LIBRARY = "../vendor/tasks_vision/vision_wasm_module_internal";
let loads = 0;

/** Return the library's files; its loader works only once, so each use gets its own address. */
const files = () => ({
  wasmLoaderPath: new URL(`${LIBRARY}.js?use=${(loads += 1)}`, import.meta.url).href,
  wasmBinaryPath: new URL(`${LIBRARY}.wasm`, import.meta.url).href,
});
const PEOPLE = 2; // a second person is told, and the nearer one is taken
const IN_SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
let landmarker = null;
let hands = null;

/** Whether there is a GPU: software that imitates one is ten times slower than running on the CPU. */
function hasGraphics() {
  const gl = typeof OffscreenCanvas === "function" ? new OffscreenCanvas(1, 1).getContext("webgl2") : null;
  if (!gl) return false;
  const known = gl.getExtension("WEBGL_debug_renderer_info");
  const name = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return !IN_SOFTWARE.test(name);
}

const modelAt = (name) => new URL(`../../models/${name}.task`, import.meta.url).href;

async function make({ model, hands: wanted }, delegate) {
  landmarker = await PoseLandmarker.createFromOptions(files(), {
    baseOptions: { modelAssetPath: modelAt(`pose_landmarker_${model}`), delegate }, runningMode: "VIDEO", numPoses: PEOPLE,
  });
  if (wanted) hands = await Hands.load(files(), modelAt("hand_landmarker"), delegate);
  return { kind: "loaded", delegate };
}

async function load(wanted) {
  if (!hasGraphics()) return make(wanted, "CPU");
  try {
    return await make(wanted, "GPU");
  } catch {
    return make(wanted, "CPU");
  }
}

function find({ picture, at_ms }) {
  const begin = performance.now();
  const { landmarks: people, worldLandmarks } = landmarker.detectForVideo(picture, at_ms);
  const one = people.length ? nearest(people) : null;
  const found = one === null ? { landmarks: null, world: null } : { landmarks: people[one], world: worldLandmarks[one] };
  const seen = hands && found.landmarks ? hands.find(picture, found.landmarks) : { left: null, right: null };
  return { kind: "found", picture, ...found, people: people.length, hands: seen, took_ms: performance.now() - begin };
}

addEventListener("message", async ({ data }) => {
  try {
    if (data.kind === "load") postMessage(await load(data));
    else postMessage(find(data), [data.picture]); // the page shows it
  } catch (error) {
    postMessage({ kind: "failed", reason: String(error?.message ?? error) });
  }
});
