// Every call to the server: routes under /api/v1, errors as the server words them, in the language of the page.
import { hear, said } from "./said.js";
import { t } from "./strings.js";

const ROOT = new URL("api/v1/", document.baseURI);

/** Address of the events WebSocket. */
export const eventsUrl = () => new URL("events", ROOT).href.replace(/^http/, "ws");

const request = (method, path, body) => (body === undefined ? send(method, path) : send(method, path, JSON.stringify(body), { "Content-Type": "application/json" }));

async function send(method, path, body, headers = {}, signal = undefined) {
  let response;
  try {
    response = await fetch(new URL(path, ROOT), { method, headers, body, signal });
  } catch {
    throw new Error(t("server.silent"));
  }
  if (response.ok) return response;
  if (response.status === 401) signInAgain();
  const value = await response.json().catch(() => null);
  throw new Error(said(hear(value?.error)?.message) ?? t("server.status", { status: response.status }));
}

const signInAgain = () => location.assign(`signin?again&next=${encodeURIComponent(location.pathname)}`);

/** Whether the server answers within a time; a browser that is not (or no longer) signed in is sent to the sign-in page. */
export async function answers(within_ms) {
  const response = await fetch(new URL("access", ROOT), { signal: AbortSignal.timeout(within_ms) }).catch(() => null);
  if (response?.status === 401) signInAgain();
  return Boolean(response) && response.status !== 401;
}

const heard = async (response) => hear(await response.json());
const call = async (method, path, body) => heard(await request(method, path, body));

export const getView = () => call("GET", "view");
export const changeView = (change) => call("PUT", "view", change);
/** Delete the operator's view; `keepalive` because the page may close before the server answers. */
export const deleteOperatorView = (page) => fetch(new URL(`view/operator?page=${page}`, ROOT), { method: "DELETE", keepalive: true }).catch(() => null);
export const putOperatorView = (view) => call("PUT", "view/operator", view);

/** Return the server's time [s], and when the browser sent the request and received the answer [ms of `performance`]. These come
 * from its network process, because this thread may be busy. `number` distinguishes requests. */
export async function getClock(number) {
  const path = `view/clock?number=${number}`, address = new URL(path, ROOT).href;
  const { promise: timing, resolve } = Promise.withResolvers();
  const observer = new PerformanceObserver((list) => list.getEntriesByName(address).forEach(resolve));
  observer.observe({ type: "resource" });
  try {
    const [{ server_s }, { requestStart, responseStart }] = await Promise.all([call("GET", path), timing]);
    return { server_s, sent_ms: requestStart, received_ms: responseStart };
  } finally {
    observer.disconnect();
  }
}
export const getGizmo = () => call("GET", "view/gizmo");
export const showGizmo = (place_m) => call("PUT", "view/gizmo", { place_m });
export const hideGizmo = () => call("DELETE", "view/gizmo");
/** Have the 3D view show pins `{place_m, radius_m, on}` of the replayed take. */
export const showPins = (pins) => call("PUT", "view/pins", { pins });
export const openReplay = (wanted) => call("PUT", "replay", wanted);
export const changeReplay = (change) => call("PATCH", "replay", change);
export const closeReplay = () => call("DELETE", "replay");
export const getCleanup = (take, solve, performer) =>
  call("GET", `${takePath(take)}/solves/${encodeURIComponent(solve)}/cleanup${performer ? `?${new URLSearchParams({ performer })}` : ""}`);
export const getSpace = () => call("GET", "replay/space");
export const getReplayJoints = (frame) => call("GET", `replay/joints?frame=${frame}`);
export const getVideos = () => call("GET", "replay/video");
export const getVideo = (camera) => call("GET", `replay/video/${camera}`);
export const getVideoDrawn = (camera, first, last) => call("GET", `replay/video/${camera}/drawn?${new URLSearchParams({ first, last })}`);
/** Return the position of a joint seen at a place in a picture, assumed near `near_m`: `{time_s, place_m}`. */
export const getVideoPlace = (camera, picture, [x, y], [near_x, near_y, near_z]) =>
  call("GET", `replay/video/${camera}/place?${new URLSearchParams({ picture, x, y, near_x, near_y, near_z })}`);

/** Address of a picture of a camera's video; `stamp` changes with the video. */
export const videoPicture = (take, camera, number, width, stamp) => new URL(`takes/${take.split("/").map(encodeURIComponent).join("/")}/video/${camera}/pictures/${number}?${new URLSearchParams({ width, stamp })}`, ROOT);
export const getCurves = (joint) => call("GET", `replay/curves?joint=${joint}`);
export const getJointCurves = (curves, first, last, points) => call("GET", `replay/joint_curves?${new URLSearchParams([...curves.map((curve) => ["curve", curve]), ["first", first], ["last", last], ["points", points]])}`);
export const getSwitches = () => call("GET", "switches");
export const getSettings = () => call("GET", "settings");
export const putSettings = (preset, set) => call("PUT", "settings", { preset, set });
export const getRecordings = () => call("GET", "recordings");
export const openLocalCameras = (wanted) => call("POST", "local-cameras", wanted);
export const stopLocalCameras = () => call("DELETE", "local-cameras");
export const getDevices = () => call("GET", "devices");
export const searchDevices = () => call("POST", "devices/search");
export const takeDevicePicture = (id) => call("POST", `devices/${id}/picture`);
export const connectDevice = (id, name) => call("POST", `devices/${id}/connect`, { name });
export const disconnectDevice = (id) => call("POST", `devices/${id}/disconnect`);
export const getAnnounced = () => call("GET", "devices/announced");
export const callCamera = (id, code) => call("POST", `devices/announced/${id}/connect`, { code });
export const letCameraGo = (id) => call("POST", `devices/announced/${id}/disconnect`);
export const inviteCamera = () => call("POST", "cameras/invite", {});
export const invitePhoneCamera = () => call("POST", "phones/invite");
export const getPhonesVideo = () => call("GET", "phones/video");
export const putPhonesVideo = (keep) => call("PUT", "phones/video", { keep });
export const chooseReference = (name) => call("PUT", `cameras/${encodeURIComponent(name)}/reference`);
export const startRecording = (take) => call("POST", "record/start", take ? { take } : {});
export const stopRecording = () => call("POST", "record/stop");
export const startCalibration = (known = {}) => call("POST", "calibration/start", known);
export const finishCalibration = () => call("POST", "calibration/finish");
export const startTPose = (performer) => call("POST", "tpose/start", { performer });
export const cancelTPose = () => call("POST", "tpose/cancel");
export const invitePhone = () => call("POST", "remote");
export const getPerformers = () => call("GET", "performers");
export const choosePerformer = (name) => call("POST", `performers/${encodeURIComponent(name)}/use`);
export const forgetPerformer = (performer) => call("POST", "performers/forget", { performer });
export const renamePerformer = (performer, name) => call("POST", "performers/rename", { performer, name });
export const exchangePerformers = (first, second) => call("POST", "performers/exchange", { first, second });
export const keepProfile = (performer) => call("POST", "performers/keep", { performer });
export const getTakes = () => call("GET", "takes");

/** Return those of the given takes that exist. */
export const getTakesOf = (ids) => call("GET", `takes?${new URLSearchParams(ids.map((id) => ["id", id]))}`);

export const getTakeDetail = (take) => call("GET", takePath(take));
export const getNextTake = () => call("GET", "takes/next");

/** Return a page of search results, their total number, and how many of all takes have been read so far: `{takes, count,
 * reading: {done, of}}`; `reading` is null once all have been read. */
export async function findTakes({ search, limit, offset }) {
  const response = await request("GET", `takes?${new URLSearchParams({ search, limit, offset })}`);
  const [done, of] = response.headers.get("X-Takes-Read")?.split("/").map(Number) ?? [];
  return { takes: await heard(response), count: Number(response.headers.get("X-Total-Count")), reading: of === undefined ? null : { done, of } };
}
export const getPresets = () => call("GET", "presets");
export const savePreset = (name, settings) => call("PUT", `presets/${encodeURIComponent(name)}`, settings);
export const renamePreset = (name, to) => call("PATCH", `presets/${encodeURIComponent(name)}`, { name: to });
export const removePreset = (name) => call("DELETE", `presets/${encodeURIComponent(name)}`);

export const putTimecode = (source, rate) => call("PUT", "timecode", { source, rate });
export const getRigidBodies = () => call("GET", "rigid-bodies");
export const changeRigidBodies = (change) => call("PATCH", "rigid-bodies", change);
export const getTriggers = () => call("GET", "triggers");
export const changeTriggers = (change) => call("PATCH", "triggers", change);
export const getOutputs = () => call("GET", "outputs");
export const addOutput = (output) => call("POST", "outputs", output);
export const changeOutput = (id, change) => call("PATCH", `outputs/${id}`, change);
export const removeOutput = (id) => call("DELETE", `outputs/${id}`);

export const getBlindTests = () => call("GET", "blind");
export const createBlindTest = (test) => call("POST", "blind", test);
export const createThesisTest = (take) => call("POST", "blind/thesis", { take });
export const getBlindResults = (id) => call("GET", `blind/${id}/results`);
export const blindAction = (id, action, method) => call(method, `blind/${id}/${action}`);
export const showBlindSlot = (id, slot) => call("PUT", `blind/${id}/shown`, { slot });

export const getAccess = () => call("GET", "access");
export const addCameraToken = (label) => call("POST", "access/cameras", { label });
export const removeCameraToken = (id) => request("DELETE", `access/cameras/${id}`);
export const renewViewers = () => call("POST", "access/viewers");
export const renewOperator = () => call("POST", "access/operator");
export const signOut = () => request("POST", "access/signout");

const takePath = (take) => `takes/${encodeURIComponent(take.session)}/${encodeURIComponent(take.name)}`;

/** Announce files, `[{path, size}]`; returns the resulting imports: `{job, files}`, with the indices of its files in the list. */
export const announceImports = (files, sync, clap_at) => call("POST", "imports", { files, sync, clap_at });
/** Send an import's files, concatenated in one Blob. */
export const sendImport = (jobId, blob, signal) => send("PUT", `imports/${jobId}`, blob, {}, signal);

/** Cancel a job; its half-written files are removed. */
export const cancelJob = (id) => call("POST", `jobs/${id}/cancel`);
/** Remove ended jobs from the list. */
export const clearJobs = () => call("DELETE", "jobs");

/** Start solving a take again with `{preset, set}` as solve `name`. */
export const solveTake = (take, name, settings) => call("POST", `${takePath(take)}/solves`, { ...settings, name });

const editsPath = (take) => `${takePath(take)}/edits`;
export const getEdits = (take) => call("GET", editsPath(take));
const withLook = (path, look) => (look ? `${path}?${new URLSearchParams({ look })}` : path);
const editPath = (take, id) => `${editsPath(take)}/${encodeURIComponent(id)}`;
// `look` below: the solve whose frames around the playhead are solved at once with the change, or ""
export const addEdit = (take, edit, revision, look) => call("POST", withLook(editsPath(take), look), { edit, revision });
export const changeEdit = (take, id, edit, revision, look) => call("PATCH", withLook(editPath(take, id), look), { edit, revision });
export const removeEdit = (take, id, revision, look) => call("DELETE", `${editPath(take, id)}?${new URLSearchParams({ revision, ...(look && { look }) })}`);
/** Start solving the frames around the playhead with the take's edits; the result is shown there. */
export const previewEdits = (take, solve) => call("POST", `${editsPath(take)}/preview`, { solve });
/** Have the server read ahead what `previewEdits` needs. */
export const readAhead = (take, solve) => call("PUT", `${editsPath(take)}/preview`, { solve });
export const getOffers = (take, solve, performer) => call("GET", `${editsPath(take)}/offers?${new URLSearchParams({ solve, ...(performer && { performer }) })}`);
/** Replace all edits of a take, as one change. */
export const replaceEdits = (take, edits, revision, look) => call("PUT", withLook(editsPath(take), look), { edits, revision });
export const undoEdits = (take, revision, look) => call("POST", withLook(`${editsPath(take)}/undo`, look), { revision });
export const redoEdits = (take, revision, look) => call("POST", withLook(`${editsPath(take)}/redo`, look), { revision });

/** Start a job that splices parts of takes into a new take, or loops them. */
export const spliceTakes = (splice) => call("POST", "splices", splice);

/** Start a job that calibrates a take from its own frames with known values; `{borrow}`: use the calibration of that take (id). */
export const calibrateTake = (take, known) => call("POST", `${takePath(take)}/calibrations`, known);
export const getCalibrations = (take) => call("GET", `${takePath(take)}/calibrations`);
export const useCalibration = (take, number) => call("PUT", `${takePath(take)}/calibrations/in_use`, { number });

/** Return dictionaries and families of boards, and why boards cannot be detected here. */
export const getBoards = () => call("GET", "boards");

/** Make a replay of a solve to share; `part`: `{start_s, end_s}`, by default the whole solve. */
export const shareSolve = (take, solve, part) => call("POST", `${takePath(take)}/solves/${encodeURIComponent(solve)}/share`, part);
export const getShares = () => call("GET", "shares");
export const removeShare = (id) => call("DELETE", `shares/${id}`);
export const restoreShare = (id) => call("POST", `shares/${id}/restore`);

export const changeTake = (take, change) => call("PATCH", takePath(take), change);
export const throwTake = (take) => call("DELETE", takePath(take));
export const throwVideo = (take) => call("DELETE", `${takePath(take)}/video`);
export const throwSolve = (take, solve) => call("DELETE", `${takePath(take)}/solves/${encodeURIComponent(solve)}`);
export const getTrash = () => call("GET", "trash");
export const deleteTrash = (trashId) => call("DELETE", `trash/${encodeURIComponent(trashId)}`);
export const emptyTrash = () => call("DELETE", "trash");
export const restoreTake = (trashId) => call("POST", `trash/${encodeURIComponent(trashId)}/restore`);

const byId = (takeId) => `takes/${takeId.split("/").map(encodeURIComponent).join("/")}`;

/** Get a take's rigid bodies by its id; change one; measure how those on joints are mounted. Each call returns all bodies. */
export const getBodies = (takeId) => call("GET", `${byId(takeId)}/rigid-bodies`);
export const changeBody = (takeId, body) => call("PUT", `${byId(takeId)}/rigid-bodies`, body);
export const measureBodies = (takeId, wanted) => call("POST", `${byId(takeId)}/rigid-bodies/measure`, wanted);

/** Return the distance between two motions: `{a: {take, solve}, b: {take, solve} or {reference}, line_up, offset_ms}`. */
export const compareMotions = (wanted) => call("POST", "compare", wanted);

/** Return a solve's own figures and, if a reference is given, its figures against that. */
export const getFigures = ({ take, solve, performer }, reference) =>
  call("GET", `${byId(take)}/solves/${encodeURIComponent(solve)}/figures?${new URLSearchParams({ ...(reference && { reference }), ...(performer && { performer }) })}`);

/** Return the figures of all performers that have a reference. */
export const evaluateTogether = (take, solves) => call("POST", `${byId(take)}/evaluate-together`, { solves });

const referencePath = (take, name) => `${byId(take)}/references/${encodeURIComponent(name)}`;

export const getReferenceFiles = () => call("GET", "reference-files");
export const getReferences = (take) => call("GET", `${byId(take)}/references`);
export const getReference = (take, name) => call("GET", referencePath(take, name));
export const addReference = (take, file) => call("POST", `${byId(take)}/references`, { file });
export const sendReference = async (take, name, file) => heard(await send("PUT", referencePath(take, name), file));
export const alignReference = (take, name, how) => call("POST", `${referencePath(take, name)}/align`, how);
export const removeReference = (take, name) => call("DELETE", referencePath(take, name));
export const restoreReference = (take, name) => call("POST", `${referencePath(take, name)}/restore`);
export const makeReport = (take, reference, language) => call("POST", `${byId(take)}/reports`, { reference, language });
export const reportAddress = (take, name) => new URL(`${byId(take)}/reports/${encodeURIComponent(name)}`, ROOT).href;

export const getExportFormats = () => call("GET", "exports/formats");
/** Start exporting solves: `{solves: [{take, solve}], format, ...}`; returns the job. */
export const makeExport = (wanted) => call("POST", "exports", wanted);

/** Start writing a camera's depth of a take as it was recorded; returns the job. */
export const makeDepthExport = (take, camera) => call("POST", "exports/depth", { take, camera });

/** Get the robots and props that can be exported for a take; start exporting one, which returns the job. */
export const getOtherExports = (take) => call("GET", `exports/others?${new URLSearchParams({ take })}`);
export const makeRobotExport = (wanted) => call("POST", "exports/robot", wanted);
export const makePropExport = (wanted) => call("POST", "exports/prop", wanted);

/** Return the address of the file of a finished export. */
export const exportAddress = (jobId) => new URL(`exports/${jobId}`, ROOT).href;

/** Return the file of a finished export, as a Blob. */
export const downloadExport = async (jobId) => (await request("GET", `exports/${jobId}`)).blob();

export const getRobot = (name) => call("GET", `robots/${encodeURIComponent(name)}`);
export const changeRobot = (name, change) => call("PATCH", `robots/${encodeURIComponent(name)}`, change);
export const removeRobot = (name) => call("DELETE", `robots/${encodeURIComponent(name)}`);
export const restoreRobot = (name) => call("POST", `robots/${encodeURIComponent(name)}/restore`);
export const getRigs = () => call("GET", "rigs");
export const sendRig = async (name, file) => heard(await send("PUT", `rigs/${encodeURIComponent(name)}`, file));
export const getRigMapping = (name) => call("GET", `rigs/${encodeURIComponent(name)}/mapping`);
export const putRigMapping = (name, bones) => call("PUT", `rigs/${encodeURIComponent(name)}/mapping`, { bones });
