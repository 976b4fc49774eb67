// The phone's camera: opening it, choosing a lens, and what its track actually delivers.

/** Reason why there is no picture, as the end of a key `phone_camera.no.*`. */
export class NoCamera extends Error {
  constructor(why, detail = "") {
    super(detail || why);
    this.why = why;
  }
}

const REASONS = { NotAllowedError: "permission", SecurityError: "permission", NotFoundError: "camera", NotReadableError: "busy", AbortError: "busy" };

// No cropping, no scaling: Chromium would cut a portrait picture to fit, and the focal length would not be the lens's.
const WANTED = { width: { ideal: 1280 }, height: { ideal: 720 }, frameRate: { ideal: 30 }, resizeMode: { ideal: "none" } };

/** Return the stream of a camera: `deviceId`, or the one that faces away from the screen. */
export async function openCamera(deviceId) {
  if (!isSecureContext || !navigator.mediaDevices?.getUserMedia) throw new NoCamera(isSecureContext ? "support" : "secure");
  const which = deviceId ? { deviceId: { exact: deviceId } } : { facingMode: { ideal: "environment" } };
  try {
    return await navigator.mediaDevices.getUserMedia({ audio: false, video: { ...WANTED, ...which } });
  } catch (error) {
    if (deviceId && (error.name === "OverconstrainedError" || error.name === "NotFoundError")) return openCamera(null); // it has gone
    throw new NoCamera(REASONS[error.name] ?? "other", error.message);
  }
}

/** Return the cameras that can be chosen: [{deviceId, label}]. */
export async function listCameras() {
  const devices = await navigator.mediaDevices.enumerateDevices();
  return devices.filter(({ kind }) => kind === "videoinput").map(({ deviceId, label }) => ({ deviceId, label }));
}

/** Whether a lens is wide, by its label or its zoom. */
export const isWide = (track) => /ultra|0[.,]5|grand.angle|weitwinkel/i.test(track.label) || track.getSettings().zoom < 1;

/** Whether a camera faces the same way as the screen. */
export const isSelfie = (track) => track.getSettings().facingMode === "user";

/** Return the settings of a track that must not change during recording. */
export function lensOf(track) {
  const { deviceId, zoom } = track.getSettings();
  return JSON.stringify([deviceId, zoom ?? null]);
}

/** Return the exposure of a track, time times sensitivity; null where the browser does not report it. */
export function exposureOf(track) {
  const { exposureTime, iso } = track.getSettings();
  return exposureTime > 0 ? exposureTime * (iso || 1) : null;
}

/** Keep the screen on while the page is shown; `changed(on)` is called with whether it stays on. */
export function keepAwake(changed) {
  let lock = null;
  const ask = async () => {
    if (document.hidden || (lock && !lock.released)) return;
    try {
      lock = await navigator.wakeLock.request("screen");
      lock.addEventListener("release", () => changed(false));
      changed(true);
    } catch {
      changed(false); // no such function, or the phone saves its battery
    }
  };
  document.addEventListener("visibilitychange", ask);
  ask();
  return () => {
    document.removeEventListener("visibilitychange", ask);
    lock?.release();
  };
}

/** Call `changed({percent, charging})` with the battery's state, where the browser reports it. */
export async function followBattery(changed) {
  const battery = await navigator.getBattery?.();
  if (!battery) return;
  const tell = () => changed({ percent: Math.round(100 * battery.level), charging: battery.charging });
  battery.addEventListener("levelchange", tell);
  battery.addEventListener("chargingchange", tell);
  tell();
}

const SAME_US = 1000, LATE_US = 1_000_000;

/** Capture times of the pictures that a video shows: a busy page is notified of one picture but already shows a later one. */
export class PictureClock {
  #agrees = false; // whether this browser counts both times from the same moment

  /** Return the picture that the video shows, to be closed, and its capture time [ns]; `begin` and `told`: time and metadata that
   * the browser passes with the announced picture. The video may show another one a moment later. */
  taken(video, begin, told) {
    const announced_ns = Math.round(1e6 * (told.captureTime ?? begin));
    let picture = null;
    try {
      picture = new VideoFrame(video);
    } catch {
      return { picture, time_ns: announced_ns }; // there is no VideoFrame, or no picture just now
    }
    const later_us = picture.timestamp - 1e6 * told.mediaTime;
    if (Math.abs(later_us) < SAME_US) this.#agrees = true;
    const later = this.#agrees && later_us >= SAME_US && later_us < LATE_US;
    return { picture, time_ns: later ? announced_ns + Math.round(1000 * later_us) : announced_ns };
  }
}
