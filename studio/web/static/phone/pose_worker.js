// Finds the landmarks of bodies in pictures, in a thread of its own, so that the page and the link do not wait.
//
// It hears {kind: "load", model} and {kind: "frame", picture, at_ms}, one at a time, and answers each with
// {kind: "loaded" | "found" | "failed", ...}. Landmarks are as MediaPipe gives them: shares of the picture.
import { PoseLandmarker } from "../vendor/tasks_vision/vision_bundle.mjs";

const FILES = {
  wasmLoaderPath: new URL("../vendor/tasks_vision/vision_wasm_module_internal.js", import.meta.url).href,
  wasmBinaryPath: new URL("../vendor/tasks_vision/vision_wasm_module_internal.wasm", import.meta.url).href,
};
const PEOPLE = 2; // a second person is told, and the nearer one is taken
const IN_SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
let landmarker = null;

/** Whether there is a graphics processor: what only imitates one is ten times slower than the processor itself. */
function hasGraphics() {
  const gl = typeof OffscreenCanvas === "function" ? new OffscreenCanvas(1, 1).getContext("webgl2") : null;
  if (!gl) return false;
  const known = gl.getExtension("WEBGL_debug_renderer_info");
  const name = known ? gl.getParameter(known.UNMASKED_RENDERER_WEBGL) : "";
  gl.getExtension("WEBGL_lose_context")?.loseContext();
  return !IN_SOFTWARE.test(name);
}

async function make(model, delegate) {
  const modelAssetPath = new URL(`../../models/pose_landmarker_${model}.task`, import.meta.url).href;
  landmarker = await PoseLandmarker.createFromOptions(FILES, {
    baseOptions: { modelAssetPath, delegate }, runningMode: "VIDEO", numPoses: PEOPLE,
  });
  return { kind: "loaded", model, delegate };
}

async function load({ model }) {
  if (!hasGraphics()) return make(model, "CPU");
  try {
    return await make(model, "GPU");
  } catch {
    return make(model, "CPU");
  }
}

function find({ picture, at_ms }) {
  const begin = performance.now();
  const { landmarks, worldLandmarks } = landmarker.detectForVideo(picture, at_ms);
  picture.close();
  return { kind: "found", landmarks, worldLandmarks, took_ms: performance.now() - begin };
}

addEventListener("message", async ({ data }) => {
  try {
    postMessage(data.kind === "load" ? await load(data) : find(data));
  } catch (error) {
    postMessage({ kind: "failed", reason: String(error?.message ?? error) });
  }
});
