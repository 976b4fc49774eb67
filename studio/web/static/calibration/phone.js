// A phone as remote control: its address, and a QR code that signs it in if the studio requires that.
import { byId, h } from "../base/dom.js";
import { invitePhone } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { t } from "../base/strings.js";

/** Show how a phone becomes the remote control. */
export async function showPhone() {
  const invitation = await attempt(invitePhone);
  if (!invitation) return;
  if (!byId("phone")) document.body.append(h("dialog", { id: "phone", class: "phone", aria: { labelledby: "phone-title" } }));
  byId("phone").replaceChildren(
    h("h2", { id: "phone-title" }, t("phone.title")),
    h("p", {}, t(invitation.local ? "phone.local" : invitation.minutes ? "phone.scan_once" : "phone.scan", { minutes: invitation.minutes })),
    !invitation.local && h("img", { src: `data:image/svg+xml;base64,${invitation.qr}`, alt: t("phone.qr"), width: 260, height: 260 }) || "",
    h("p", {}, h("a", { href: "remote", target: "_blank" }, t("phone.here"))),
    h("form", { method: "dialog", class: "buttons" }, h("button", { type: "submit" }, t("message.close"))));
  byId("phone").showModal();
}
