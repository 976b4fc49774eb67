// The part of the dialog that adds a phone: on a press, a QR code for one phone, or what prevents it.
import { getPhonesVideo, invitePhoneCamera, putPhonesVideo } from "../base/api.js";
import { commandBox } from "./camera_command.js";
import { h } from "../base/dom.js";
import { attempt } from "../base/messages.js";
import { t } from "../base/strings.js";

const OPEN = "studio serve --host 0.0.0.0", CERTIFICATE = "studio certificate";

/** Return what to do if no phone can open the page: the commands, one after the other. */
function obstacle({ local, secure }) {
  if (!local && secure) return null;
  return [
    h("p", { class: "fair" }, t(local ? "phones.only_here" : "phones.plain")),
    commandBox(`${CERTIFICATE} && ${OPEN}`),
    h("p", { class: "muted" }, t("phones.then")),
  ];
}

function shown(invitation, again) {
  const { url, qr, minutes, fingerprint, local } = invitation;
  const blocked = obstacle(invitation);
  const link = h("a", { href: url, target: "_blank", rel: "noopener" }, url.replace(/#.*/, ""));
  if (blocked) return [...blocked, local && h("p", {}, t("phones.try_here"), " ", link)];
  return [
    h("div", { class: "by-code large" },
      h("img", { src: `data:image/svg+xml;base64,${qr}`, width: 220, height: 220, alt: t("phones.code") }),
      h("div", { class: "stack" },
        h("p", {}, t("phones.scan"), " ", link),
        minutes > 0 && h("p", { class: "muted" }, t("phones.once", { minutes })),
        fingerprint && h("p", { class: "muted" }, t("phones.warning")),
        fingerprint && h("p", { class: "fingerprint" }, h("code", {}, fingerprint.split(":").flatMap((pair, i) => (i ? [":", h("wbr"), pair] : [pair])))))),
    minutes > 0 && h("div", { class: "buttons" }, h("button", { class: "small", type: "button", onclick: again }, t("phones.next"))),
  ];
}

/** Return the switch that requests video from all phones. */
function keepVideo() {
  const box = h("input", { id: "phones-video", type: "checkbox", disabled: true, onchange: () => tell(() => putPhonesVideo(box.checked)) });
  const tell = async (ask) => {
    const told = await attempt(ask);
    if (told) Object.assign(box, { checked: told.keep, disabled: false });
  };
  tell(getPhonesVideo);
  return h("label", { class: "row", title: t("phones.keep_video_hint") }, box, t("phones.keep_video"));
}

/** Return the part; no invitation is made before the button is pressed. */
export function phonePart() {
  const place = h("div", { id: "phone-invitation", class: "stack" });
  const show = async () => {
    const invitation = await attempt(invitePhoneCamera);
    if (invitation) place.replaceChildren(...shown(invitation, show).filter(Boolean));
  };
  place.append(h("p", { class: "muted" }, t("phones.words")),
    h("div", { class: "buttons" }, h("button", { id: "invite-phone", type: "button", onclick: show }, t("phones.show"))));
  return h("section", { class: "devices" }, h("h3", {}, t("phones.title")), place, keepVideo());
}
