// How the phone joins: it exchanges the QR code's invitation for a name and a token, which this browser keeps.
import { t } from "../base/strings.js";
import { NoCamera } from "./camera.js";

const KEPT = "phone-camera";

/** Return what this browser has kept: {name, token}. */
export function known() {
  return { name: "", token: "", ...JSON.parse(localStorage.getItem(KEPT) ?? "{}") };
}

/** Forget the token, which the studio no longer accepts. */
export const forgetEntry = () => localStorage.setItem(KEPT, JSON.stringify({ name: known().name }));

/** Whether a camera may have this name. */
export const isName = (name) => /^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}$/.test(name);

async function ask(invitation, name) {
  let answer;
  try {
    answer = await fetch("api/v1/phones", { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify({ invitation, name }) });
  } catch {
    throw new NoCamera("studio");
  }
  const body = await answer.json().catch(() => ({}));
  if (answer.ok) return body;
  if (answer.status === 401) throw new Error(t("phone_camera.no.code"));
  throw new Error(body.error?.message ?? String(answer.status));
}

/** Return {name, token} for the hello: by the invitation in the address, or as kept from an earlier visit. */
export async function enter(name) {
  const invitation = location.hash.slice(1), before = known();
  if (!invitation && before.token) return keep({ name: name || before.name, token: before.token });
  const entry = await ask(invitation, name);
  history.replaceState(null, "", location.pathname); // the invitation is used up
  return keep(entry);
}

function keep(entry) {
  localStorage.setItem(KEPT, JSON.stringify(entry));
  return entry;
}
