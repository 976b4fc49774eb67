// Export recipes: well-known programs, each with the format and options that it opens correctly.

/** Formats of motions. */
export const OF_SOLVES = ["fbx", "bvh", "glb", "usd", "c3d", "trc", "csv", "npz"];

/** Format of depth as recorded, independent of any solve. */
export const DEPTH = "mkv";
export const FORMATS = [...OF_SOLVES, DEPTH];
export const TARGETS = ["humanik", "mixamo", "unreal", "vrm"];
export const ROOTS = ["hips", "root", "in-place"];
export const KEYS = ["cubic", "linear", "constant"];
export const RATES = ["", 24, 25, 30, 60, 120];
export const ORDERS = ["ZXY", "ZYX", "YZX", "XZY", "YXZ", "XYZ"];
export const UNITS = ["cm", "m", "mm", "in"];

const SKELETONS = ["fbx", "bvh", "glb", "usd"];

/** Formats that understand an option; for others it is hidden and not sent. */
export const UNDERSTOOD = {
  target: SKELETONS, root_motion: SKELETONS, interpolation: ["fbx", "glb"], mesh: ["fbx", "glb", "usd"], key_error_cm: ["fbx"],
  timecode: ["fbx", "bvh", "usd", "c3d", "csv", "npz"], rotation_order: ["bvh"], unit: ["bvh"], together: ["fbx"],
  fps: OF_SOLVES, start_s: OF_SOLVES, end_s: OF_SOLVES, smooth_hz: OF_SOLVES, foot_lock: OF_SOLVES, loop: OF_SOLVES, camera: [DEPTH], performer: OF_SOLVES,
};

/** Formats that can hold several performers. */
export const SCENES = ["fbx", "glb", "usd"];

/** Formats of an export onto a rig. */
export const RIG_FORMATS = SKELETONS;

const fbx = { format: "fbx", target: "humanik", root_motion: "hips", interpolation: "cubic", mesh: false };

/** Recipes by name, in the order of the page. */
export const RECIPES = {
  motionbuilder: fbx,
  unreal: { ...fbx, target: "unreal", root_motion: "root" },
  unity: { ...fbx, target: "vrm", root_motion: "root", mesh: true },
  blender: { ...fbx, mesh: true },
  mixamo: { ...fbx, target: "mixamo" },
  web: { ...fbx, format: "glb", mesh: true },
  biomechanics: { format: "c3d" },
  opensim: { format: "trc" },
  rig: { ...fbx },
};

/** Return the first recipe with a format that was chosen directly; "" if there is none. */
export const recipeOf = (format) => Object.keys(RECIPES).find((name) => RECIPES[name].format === format) ?? "";
