// A camera's command, ready to copy: in the studio, and on the page that its QR code opens.
import { h } from "../base/dom.js";
import { t } from "../base/strings.js";

const COPIED_MS = 1500;

/** Devices: value of `--source`, and common name. */
export const SOURCES = [
  ["realsense", "Intel RealSense"], ["orbbec", "Orbbec"], ["azure-kinect", "Azure Kinect"], ["kinect-v2", "Kinect v2"],
  ["openni", "Kinect v1, Xtion (OpenNI)"],
];

/** Return the common name of a kind of source. */
export const labelOf = (kind) => SOURCES.find(([source]) => source === kind)?.[1] ?? kind;

/** Return a box with a command and a button that copies it; if copying is not allowed, its text is selected. */
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

/** Return the command that starts a device's client; `invitation`: the studio's `server` and optionally a `token`. */
export const commandOf = (source, { server, token }) => `studio camera --source ${source} --server ${server}${token ? ` --token ${token}` : ""}`;

/** Return a choice of the device with the command for it. */
export function commandFor(invitation) {
  const box = h("div", {});
  const show = () => box.replaceChildren(commandBox(commandOf(choice.value, invitation)));
  const choice = h("select", { id: "add-source", onchange: show }, SOURCES.map(([value, label]) => h("option", { value }, label)));
  show();
  return [h("label", { class: "field" }, h("span", {}, t("cameras.device")), choice), box];
}
