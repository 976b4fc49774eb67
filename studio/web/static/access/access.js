// The access panel, where the studio is open to the network: camera tokens, the operator's token, signing out.
import { setAddress } from "../base/address.js";
import { byId, h, redraw, setText } from "../base/dom.js";
import { addCameraToken, getAccess, removeCameraToken, renewOperator, renewViewers, signOut } from "../base/api.js";
import { askSure } from "../base/ask.js";
import { attempt, showNote } from "../base/messages.js";
import { language, t } from "../base/strings.js";

const ENTRANCE = "signin";

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote(t("message.copied"));
  } catch {
    showNote(t("message.copy_by_hand"));
  }
}

/** Show a secret, once, with a button that copies it. */
function secret(label, text) {
  byId("access-secret").replaceChildren(h("div", { class: "secret" },
    h("p", {}, label),
    h("code", { tabIndex: 0 }, text),
    h("button", { class: "small", type: "button", onclick: () => copy(text) }, t("message.copy"))));
}

async function pair(event) {
  event.preventDefault();
  const input = byId("camera-label");
  const made = await attempt(() => addCameraToken(input.value.trim()));
  if (!made) return;
  input.value = "";
  secret(t("access.command"), made.command);
  await attempt(updateAccess);
}

function row(camera) {
  const revoke = async () => {
    if (!(await askSure(t("access.revoke"), t("access.revoke_sure", { name: camera.label }), t("access.revoke")))) return;
    await attempt(() => removeCameraToken(camera.id));
    await attempt(updateAccess);
  };
  return h("li", { class: "solve-row" },
    h("span", { class: "name", title: t("access.since", { date: new Date(camera.created).toLocaleString(language()) }) }, camera.label),
    h("button", {
      class: "small", type: "button", onclick: revoke, title: t("access.revoke_hint"),
      aria: { label: t("access.revoke_label", { name: camera.label }) },
    }, t("access.revoke")));
}

async function inviteViewers() {
  const made = await attempt(renewViewers);
  if (made) secret(t("access.viewer_link"), made.link);
}

async function renew() {
  if (!(await askSure(t("access.renew"), t("access.renew_sure"), t("access.renew")))) return;
  const made = await attempt(renewOperator);
  if (!made) return;
  secret(t("access.new_token"), made.token);
}

function build(cameras) {
  return [
    cameras.length > 0 && h("ul", {}, cameras.map(row)),
    h("form", { class: "pair", onsubmit: pair },
      h("input", { id: "camera-label", type: "text", maxLength: 60, required: true, placeholder: t("access.label_example"), aria: { label: t("access.label") } }),
      h("button", { type: "submit" }, t("access.pair"))),
    h("div", { id: "access-secret" }),
    h("div", { class: "buttons" },
      h("button", { class: "small", type: "button", onclick: inviteViewers, title: t("access.viewers_hint") }, t("access.viewers")),
      h("button", { class: "small", type: "button", onclick: renew }, t("access.renew")),
      h("button", { class: "small", type: "button", onclick: async () => { await attempt(signOut); location.assign(ENTRANCE); } }, t("access.sign_out"))),
  ].filter(Boolean);
}

/** Show the camera tokens; hidden from viewers and where the studio requires no tokens. Returns the role of this browser. */
export async function updateAccess() {
  const access = await getAccess();
  setAddress(access);
  byId("access-panel").hidden = !access.required || access.role !== "operator";
  if (access.required && access.role === "operator") show(access);
  return access.role;
}

function show(access) {
  setText(byId("access-count"), t("access.tokens", { n: access.cameras.length }));
  const shown = byId("access-secret")?.firstChild;
  redraw(byId("access"), access.cameras, () => build(access.cameras));
  if (shown) byId("access-secret").replaceChildren(shown);
}
