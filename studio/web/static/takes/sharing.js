// The share dialog: a solve becomes a replay in one HTML file with a link to it; all links, and revoking them.
import { linkTo, onlyHere } from "../base/address.js";
import { byId, h } from "../base/dom.js";
import { getShares, removeShare, restoreShare, shareSolve } from "../base/api.js";
import { attempt, showNote, showUndo, undoing } from "../base/messages.js";
import { replayed } from "../replay/replay.js";
import { language, number, t } from "../base/strings.js";

const state = { take: null, solve: "", share: null };

const fileOf = (share) => `api/v1/shares/${share.id}/file`;
const sizeOf = (share) => t("share.mb", { mb: number(share.size_bytes / 1e6, share.size_bytes < 1e7 ? 1 : 0) });
const dayOf = (share) => new Date(share.created).toLocaleString(language(), { day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" });

function dialog() {
  if (!byId("share-dialog")) {
    document.body.append(h("dialog", { id: "share-dialog", class: "sharing", aria: { labelledby: "share-title" }, onclose: () => { state.take = null; } }));
  }
  return byId("share-dialog");
}

async function copy(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote(t("share.copied"));
  } catch {
    getSelection().selectAllChildren(byId("share-link"));
  }
}

/** Return the part between in and out, if this take is replayed and has one. */
function part(take) {
  const { open, take: shown, first, last, frames, rate_hz: rate } = replayed();
  if (!open || shown !== take.id) return {};
  return { ...(first > 0 && { start_s: first / rate }), ...(last < frames - 1 && { end_s: last / rate }) };
}

const TAKE_BACK = undoing("share", (id) => attempt(async () => { await restoreShare(id); if (byId("share-dialog")?.open) await show(); }));

async function takeBack(share) {
  await attempt(async () => {
    await removeShare(share.id);
    showUndo(t("share.taken_back", { title: share.title }), TAKE_BACK, share.id);
    if (state.share?.id === share.id) byId("share-dialog").close();
    else await show();
  });
}

function made(share) {
  return [
    h("div", { class: "shared" },
      h("img", { src: `api/v1/shares/${share.id}/qr`, alt: t("share.qr"), width: 132, height: 132 }),
      h("div", { class: "stack" },
        h("p", { class: "muted" }, t("share.about", { size: sizeOf(share) })),
        h("div", { class: "copy" }, h("code", { id: "share-link", tabIndex: 0 }, linkTo(share.path)),
          h("button", { class: "small", type: "button", onclick: () => copy(linkTo(share.path)) }, t("share.copy"))),
        h("div", { class: "row" },
          h("a", { class: "button primary", href: fileOf(share), download: "" }, t("share.download")),
          h("a", { class: "button", href: share.path, target: "_blank", rel: "noreferrer" }, t("share.open"))),
        onlyHere() && h("p", { class: "muted" }, t("share.local")))),
  ];
}

function row(share) {
  const what = `${share.take}, ${share.solve}`;
  return h("li", { class: "share-row" },
    h("a", { href: share.path, target: "_blank", rel: "noreferrer", title: what }, share.title),
    h("span", { class: "muted" }, `${dayOf(share)} · ${sizeOf(share)}`),
    h("a", { class: "button small", href: fileOf(share), download: "", aria: { label: t("share.download_one", { title: share.title }) } }, t("share.file")),
    h("button", { class: "small", type: "button", onclick: () => takeBack(share), aria: { label: t("share.take_back_one", { title: share.title }) } }, t("share.take_back")));
}

async function show() {
  const shares = await getShares();
  const others = shares.filter((share) => share.id !== state.share?.id);
  dialog().replaceChildren(
    h("h2", { id: "share-title" }, state.share ? t("share.title", { title: state.share.title }) : t("share.making")),
    ...(state.share ? made(state.share) : [h("progress", { aria: { label: t("share.making") } })]),
    others.length > 0 && h("details", {}, h("summary", {}, t("share.others", { n: others.length })), h("ul", {}, others.map(row))) || "",
    h("form", { method: "dialog", class: "buttons" },
      state.share && h("button", { class: "small", type: "button", onclick: () => takeBack(state.share) }, t("share.take_back")),
      h("button", { type: "submit" }, t("share.close"))));
}

/** Make a replay of a take's solve to share, and show its link. */
export async function askShare(take, solve) {
  Object.assign(state, { take, solve, share: null });
  await attempt(show);
  dialog().showModal();
  const share = await attempt(() => shareSolve(take, solve, part(take)));
  if (state.take !== take) return; // closed meanwhile: the link is in the list
  if (!share) {
    dialog().close();
    return;
  }
  state.share = share;
  await attempt(show);
}
