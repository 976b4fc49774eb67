// Every call to the server: routes under /api/v1, errors as the server words them.
const ROOT = new URL("api/v1/", document.baseURI);

/** Address of the events WebSocket. */
export const eventsUrl = () => new URL("events", ROOT).href.replace(/^http/, "ws");

async function call(method, path, body) {
  let response;
  try {
    response = await fetch(new URL(path, ROOT), {
      method,
      headers: body === undefined ? {} : { "Content-Type": "application/json" },
      body: body === undefined ? undefined : JSON.stringify(body),
    });
  } catch {
    throw new Error("The server does not answer.");
  }
  const text = await response.text();
  let value = null;
  try {
    value = text ? JSON.parse(text) : null;
  } catch {
    // not JSON: the status says enough
  }
  if (!response.ok) throw new Error(value?.error?.message ?? value?.detail ?? `The server answered ${response.status}.`);
  return value;
}

export const getView = () => call("GET", "view");
export const putLayers = (layers) => call("PUT", "view", { layers });
export const getSwitches = () => call("GET", "switches");
export const getSettings = () => call("GET", "settings");
export const putSettings = (preset, set) => call("PUT", "settings", { preset, set });
export const startRecording = (name) => call("POST", "recording", name ? { name } : {});
export const stopRecording = () => call("DELETE", "recording");
export const startCalibration = () => call("POST", "calibration", {});
export const getTakes = () => call("GET", "takes");
export const solveTake = (take, settings) => call("POST", `takes/${take.id}/solves`, settings);
export const exportLink = (take, solve, format) => new URL(`takes/${take.id}/solves/${solve}/export?format=${format}`, ROOT).href;
