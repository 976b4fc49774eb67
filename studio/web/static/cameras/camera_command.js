// A camera's command, ready to copy: in the studio, and on the page that its QR code opens.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

const COPIED_MS = 1500;

/** Devices: what `--source` takes, and what people call them. */
export const SOURCES = [
  ["realsense", "Intel RealSense"], ["orbbec", "Orbbec"], ["azure-kinect", "Azure Kinect"], ["kinect-v2", "Kinect v2"],
  ["openni", "Kinect v1, Xtion (OpenNI)"],
];

/** What people call a kind of source. */
export const labelOf = (kind) => SOURCES.find(([source]) => source === kind)?.[1] ?? kind;

/** A command in a box with a button that copies it; where that is not allowed, its text is selected. */
export function commandBox(command) {
  const code = h("code", { tabIndex: 0 }, command);
  const button = h("button", { class: "small", type: "button", onclick: () => copy() }, t("message.copy"));
  async function copy() {
    try {
      await navigator.clipboard.writeText(command);
      button.textContent = t("message.copied");
      setTimeout(() => { button.textContent = t("message.copy"); }, COPIED_MS);
    } catch {
      getSelection().selectAllChildren(code);
    }
  }
  return h("p", { class: "copy" }, code, button);
}

/** The command that starts a device's client, `invitation`: the studio's `server` and perhaps a `token`. */
export const commandOf = (source, { server, token }) => `studio camera --source ${source} --server ${server}${token ? ` --token ${token}` : ""}`;

/** A choice of the device with the command for it. */
export function commandFor(invitation) {
  const box = h("div", {});
  const show = () => box.replaceChildren(commandBox(commandOf(choice.value, invitation)));
  const choice = h("select", { id: "add-source", onchange: show }, SOURCES.map(([value, label]) => h("option", { value }, label)));
  show();
  return [h("label", { class: "field" }, h("span", {}, t("cameras.device")), choice), box];
}
