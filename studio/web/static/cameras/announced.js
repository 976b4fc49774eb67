// Cameras on other machines waiting for a studio, in the dialog that adds cameras: a code and a click connect one.
import { onlyHere } from "../base/address.js";
import { callCamera, getAnnounced, letCameraGo } from "../base/api.js";
import { byId, h, redraw } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";
import { commandBox, labelOf } from "./camera_command.js";

const WAITING = "studio camera --source SOURCE --name NAME --wait";

/** Request the waiting cameras, and show them. */
export async function showAnnounced() {
  const list = await getAnnounced().catch(() => null); // a server that is away is told by the page
  if (list && byId("announced")) draw(list);
}

async function act(action) {
  await attempt(action);
  await showAnnounced();
}

function draw({ on, problem, cameras }) {
  const list = byId("announced");
  const rows = cameras.map((one) => byId(`announced-${one.id}`) ?? h("li", { class: "device waiting", id: `announced-${one.id}` },
    h("div", { class: "about" }), h("div", { class: "act" })));
  if (rows.length !== list.children.length || rows.some((row, k) => row !== list.children[k])) list.replaceChildren(...rows);
  cameras.forEach((one, k) => {
    const [words, acts] = rows[k].children, held = acts.contains(document.activeElement);
    redraw(words, [one.name, one.kind, one.address, one.state], () => about(one));
    redraw(acts, one.state === "free", () => acting(one));
    if (held && !acts.contains(document.activeElement)) acts.querySelector("button")?.focus(); // what was pressed is gone
  });
  redraw(byId("announced-none"), [on, problem, cameras.length, onlyHere()], () => hints(on, problem, cameras.length));
}

const about = ({ name, kind, address, state }) => [
  h("p", { class: "name" }, name, h("span", { class: "muted" }, ` ${labelOf(kind)}, ${address}`)),
  h("p", { class: `now ${state === "connected" ? "good" : "muted"}`, role: "status" }, t(`announced.state.${state}`)),
];

function acting({ id, name, state }) {
  const device = { device: name };
  if (state !== "free") {
    return h("button", { type: "button", id: `act-${id}`, aria: { label: t("devices.disconnect_label", device) }, onclick: () => act(() => letCameraGo(id)) }, t("devices.disconnect"));
  }
  const code = h("input", { id: `code-${id}`, type: "text", class: "code", required: true, maxLength: 40, autocomplete: "off", spellcheck: false, placeholder: "XXXX-XXXX-XXXX", aria: { label: t("announced.code", { name }) } });
  return h("form", { onsubmit: (event) => { event.preventDefault(); act(() => callCamera(id, code.value)); } }, code,
    h("button", { id: `act-${id}`, class: "primary", type: "submit", aria: { label: t("devices.connect_label", device) } }, t("devices.connect")));
}

function hints(on, problem, count) {
  if (problem) return h("p", { class: "bad" }, said(problem));
  if (!on) return h("p", { class: "muted" }, t("announced.off"));
  return [
    h("p", { class: "muted" }, t(count ? "announced.more" : "announced.none")),
    commandBox(WAITING),
    onlyHere() && h("p", { class: "muted" }, t("announced.only_here")),
  ].filter(Boolean);
}

/** Return the part of the dialog with the waiting cameras. */
export const announcedPart = () => h("section", { class: "devices" },
  h("h3", {}, t("announced.title")), h("ul", { id: "announced" }), h("div", { id: "announced-none", class: "stack" }));
