// The access panel, where the studio is open to the network: camera tokens, the operator's token, signing out.
import { byId, h, plural, redraw, setText } from "./dom.js";
import { addCameraToken, getAccess, removeCameraToken, renewOperator, signOut } from "./api.js";
import { attempt, showNote } from "./messages.js";

const ENTRANCE = "signin";

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote("Copied");
  } catch {
    showNote("Select the text and copy it: this page may not write to the clipboard");
  }
}

/** A secret that is shown once, with a button that copies it. */
function secret(label, text) {
  byId("access-secret").replaceChildren(h("div", { class: "secret" },
    h("p", {}, label),
    h("code", { tabIndex: 0 }, text),
    h("button", { class: "small", type: "button", onclick: () => copy(text) }, "Copy")));
}

async function pair(event) {
  event.preventDefault();
  const input = byId("camera-label");
  const made = await attempt(() => addCameraToken(input.value.trim()));
  if (!made) return;
  input.value = "";
  secret("Run this on the camera's machine. It is shown only now.", made.command);
  await attempt(updateAccess);
}

function row(camera) {
  const revoke = async () => {
    await attempt(() => removeCameraToken(camera.id));
    await attempt(updateAccess);
  };
  return h("li", { class: "solve-row" },
    h("span", { class: "name", title: `Since ${new Date(camera.created).toLocaleString()}` }, camera.label),
    h("button", {
      class: "small", type: "button", onclick: revoke, title: "Cameras that came with this token are cut off",
      aria: { label: `Revoke the token of ${camera.label}` },
    }, "Revoke"));
}

async function renew() {
  const made = await attempt(renewOperator);
  if (!made) return;
  secret("The new operator's token. Everybody must sign in again, you too.", made.token);
}

function build(cameras) {
  return [
    cameras.length > 0 && h("ul", {}, cameras.map(row)),
    h("form", { class: "pair", onsubmit: pair },
      h("input", { id: "camera-label", type: "text", maxLength: 60, required: true, placeholder: "laptop by the window", aria: { label: "Whose cameras" } }),
      h("button", { type: "submit" }, "Pair cameras")),
    h("div", { id: "access-secret" }),
    h("div", { class: "solve-row" },
      h("button", { class: "small", type: "button", onclick: renew }, "New operator's token"),
      h("button", { class: "small", type: "button", onclick: async () => { await attempt(signOut); location.assign(ENTRANCE); } }, "Sign out")),
  ].filter(Boolean);
}

/** Show who may send; nothing at all on a studio that asks for no tokens. */
export async function updateAccess() {
  const access = await getAccess();
  byId("access-panel").hidden = !access.required;
  if (!access.required) return;
  setText(byId("access-count"), plural(access.cameras.length, "camera token"));
  const shown = byId("access-secret")?.firstChild;
  redraw(byId("access"), access.cameras, () => build(access.cameras));
  if (shown) byId("access-secret").replaceChildren(shown);
}
