// The dialog that adds cameras: devices on the server's machine by a click, simulated ones, a recording, or a device on
// another machine by a command or a QR code.
import { getRecordings, inviteCamera, openLocalCameras } from "../base/api.js";
import { commandFor } from "./camera_command.js";
import { announcedPart } from "./announced.js";
import { phonePart } from "./phone_part.js";
import { devicesPart, showDevices } from "./devices.js";
import { byId, h } from "../base/dom.js";
import { attempt, showNote } from "../base/messages.js";
import { t } from "../base/strings.js";

/** Start the simulated stage on the server's machine. */
export const startSimulated = () => open({ simulated: true });

async function open(wanted, words = "cameras.starting") {
  const opened = await attempt(() => openLocalCameras(wanted));
  if (!opened) return;
  byId("add-camera-dialog").close();
  showNote(t(words));
}

function elsewhere(invitation) {
  return [
    ...commandFor(invitation),
    h("div", { class: "by-code" },
      h("img", { src: `data:image/svg+xml;base64,${invitation.qr}`, width: 148, height: 148, alt: t("cameras.code") }),
      h("div", { class: "stack" },
        h("p", {}, t("cameras.code_words")),
        h("p", {}, h("a", { href: invitation.url, target: "_blank", rel: "noopener" }, invitation.url.replace(/#.*/, ""))),
        invitation.token && h("p", { class: "muted" }, t("cameras.token_once")),
        invitation.local && h("p", { class: "fair" }, t("cameras.only_here")))),
  ];
}

function recordings(found) {
  const search = h("input", { type: "search", placeholder: t("cameras.search"), aria: { label: t("cameras.search") }, oninput: () => show() });
  const list = h("ul", { class: "recordings" });
  const row = ({ id, cameras, calibrated }) => h("li", {}, h("button", {
    type: "button", class: "recording", onclick: () => open({ recording: id }, calibrated ? "cameras.starting_calibrated" : "cameras.starting_uncalibrated"),
  },
  h("span", { class: "name" }, id.replace(/^\w+\//, "")),
  h("span", { class: "muted" }, [cameras.length ? t("cameras.count", { n: cameras.length }) : "", t(calibrated ? "cameras.with_calibration" : "cameras.without_calibration")].filter(Boolean).join(" · "))));
  const show = () => list.replaceChildren(...found.filter(({ id }) => id.toLowerCase().includes(search.value.toLowerCase())).map(row));
  show();
  return found.length ? [found.length > 6 && search, list] : [h("p", { class: "muted" }, t("cameras.no_recording"))];
}

const part = (title, ...content) => h("section", { class: "stack" }, h("h3", {}, title), ...content.flat().filter(Boolean));

/** Open the dialog. */
export async function showAddCamera() {
  const found = await attempt(async () => Promise.all([getRecordings(), inviteCamera()]));
  if (!found) return;
  const [all, invitation] = found;
  const dialog = byId("add-camera-dialog");
  dialog.replaceChildren(
    h("h2", {}, t("cameras.add")),
    devicesPart(),
    phonePart(),
    announcedPart(),
    h("div", { class: "add-camera" },
      part(t("cameras.elsewhere"), elsewhere(invitation)),
      h("div", { class: "stack" },
        part(t("cameras.simulation"), h("p", { class: "muted" }, t("cameras.simulation_words")),
          h("div", { class: "buttons" }, h("button", { type: "button", onclick: startSimulated }, t("cameras.simulate"))),
          h("p", { class: "muted" }, t("devices.simulated_words")), h("ul", { id: "simulated-devices" })),
        part(t("cameras.recording"), h("p", { class: "muted" }, t("cameras.recording_words")), recordings(all)))),
    h("form", { method: "dialog" }, h("button", { type: "submit" }, t("message.close"))));
  dialog.showModal();
  await showDevices(dialog);
}
