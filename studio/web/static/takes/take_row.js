// A take in the list: picture, name, length, rating and star, its solves, and the form of its slate.
import { byId, clock, h } from "../base/dom.js";
import { askExport } from "../export/export.js";
import { tenths } from "../replay/holds.js";
import { performerWords } from "../replay/performers.js";
import { open } from "../replay/replay.js";
import { said } from "../base/said.js";
import { askShare } from "./sharing.js";
import { language, number, t } from "../base/strings.js";

const BEST = ["finish", "studio", "live", "imported", "spliced"];
const STARS = 5;
const MAX_NAME = 60, MAX_NOTES = 2000, MAX_TAGS = 400;

/** Return the name of the solve that shows a take best. */
export const bestSolve = (take) => BEST.find((name) => take.solves.includes(name)) ?? take.solves[0];

/** Return a name for a solve: the preset's if no switch differs from it, else the preset's with a free number. */
export function freeName(take, settings) {
  if (Object.keys(settings.set).length === 0) return settings.preset;
  let number = 2;
  while (take.solves.includes(`${settings.preset}_${number}`)) number += 1;
  return `${settings.preset}_${number}`;
}

function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const today = new Date().toDateString() === date.toDateString();
  const time = date.toLocaleTimeString(language(), { hour: "2-digit", minute: "2-digit" });
  return today ? time : `${date.toLocaleDateString(language(), { day: "numeric", month: "short" })} ${time}`;
}

function small(text, label, onclick, title = label, props = {}) {
  return h("button", { class: "small", type: "button", onclick, title, aria: { label }, ...props }, text);
}

function solveRow(take, solve, acts, shown) {
  return h("li", { class: `solve-row ${shown ? "shown" : ""}` },
    small("▶", t("take.replay", { name: take.name, solve }), () => open(take.id, solve), t("take.replay_hint"), { class: "small square" }),
    h("span", { class: "name", title: t("take.solve_hint", { solve }) }, solve),
    small(t("export.short"), t("take.export", { name: take.name, solve }), () => askExport([{ take, solve }])),
    small(t("share.short"), t("share.take", { name: take.name, solve }), () => askShare(take, solve), t("share.hint")),
    small("×", t("solve.remove", { name: take.name, solve }), () => acts.removeSolve(take, solve), t("solve.remove_hint"), { class: "small square quiet" }));
}

function slate(take, acts) {
  const save = (event) => {
    event.preventDefault();
    const value = (name) => byId(`slate-${name}`).value.trim();
    const tags = value("tags").split(",").map((tag) => tag.trim()).filter(Boolean);
    const values = { name: value("name"), performer: value("performer"), notes: value("notes"), tags, rating: Number(value("rating")) };
    acts.edit(null);
    acts.change(take, values);
  };
  const field = (name, label, longest, text = take[name] ?? "", hint = "") => h("label", { class: "field" }, h("span", {}, label),
    h("input", { id: `slate-${name}`, type: "text", maxLength: longest, value: text, placeholder: hint, required: name === "name" }));
  return h("form", { class: "slate", onsubmit: save, onkeydown: (event) => { if (event.key === "Escape") { event.stopPropagation(); acts.edit(null); } } },
    field("name", t("take.name"), MAX_NAME), field("performer", t("performer.title"), MAX_NAME),
    h("label", { class: "field" }, h("span", {}, t("take.notes")), h("textarea", { id: "slate-notes", rows: 3, maxLength: MAX_NOTES, value: take.notes ?? "" })),
    field("tags", t("take.tags"), MAX_TAGS, take.tags.join(", "), t("take.tags_hint")),
    h("label", { class: "field" }, h("span", {}, t("take.rating")), h("select", { id: "slate-rating" },
      [...Array(STARS + 1).keys()].map((stars) => h("option", { value: stars, selected: stars === (take.rating ?? 0) }, stars ? "★".repeat(stars) : t("take.no_rating"))))),
    h("div", { class: "buttons" },
      h("button", { class: "small primary", type: "submit" }, t("message.save")),
      small(t("message.cancel"), t("message.cancel"), () => acts.edit(null)),
      h("span", { class: "spacer" }),
      take.calibrated && take.cameras.length > 0 && small(t("take.calibrate_again"), t("take.calibrate_again"), () => { acts.edit(null); acts.calibrate(take); }, t("take.calibrate_again_words")),
      take.video_bytes > 0 && small(t("video.throw", { mb: megabytes(take) }), t("video.throw", { mb: megabytes(take) }), () => { acts.edit(null); acts.throwVideo(take); }, t("video.throw_hint")),
      small(t("take.throw"), t("take.throw_label", { name: take.name }), () => { acts.edit(null); acts.throwAway(take); }, t("take.throw_hint"))));
}

function picture(take, best, made) {
  const label = t("take.replay", { name: take.name, solve: best });
  const image = take.thumbnail && h("img", {
    src: `api/v1/takes/${take.id.split("/").map(encodeURIComponent).join("/")}/thumbnail?n=${made}`, alt: "", width: 56, height: 56, loading: "lazy",
  });
  if (!best && !take.recording && take.cameras.length) return h("button", {
    class: "take-picture none", type: "button", title: t("take.raw_hint"), aria: { label: t("take.open", { name: take.name }) }, onclick: () => open(take.id, ""),
  }, h("span", { class: "play", aria: { hidden: "true" } }, "▶"));
  if (!best) return h("span", { class: "take-picture none", aria: { hidden: "true" } }, take.recording ? "●" : "–");
  return h("button", { class: "take-picture", type: "button", title: label, aria: { label: t("take.open", { name: take.name }) }, onclick: () => open(take.id, best) },
    image, h("span", { class: "play", aria: { hidden: "true" } }, "▶"));
}

/** Return how long the performance is, as its replay counts, and what was recorded before it. */
function length({ seconds, calibration_s: before }) {
  if (seconds === null) return "";
  return before ? t("take.length", { performance: clock(Math.max(seconds - before, 0)), before: clock(before) }) : clock(seconds);
}

const megabytes = ({ video_bytes: bytes }) => number(bytes / 1e6, bytes < 1e7 ? 1 : 0);

function line(take) {
  const performers = take.performers.map((one) => performerWords(take.performer_names[one] ?? one)).join(", ");
  const parts = [length(take), when(take.created), take.performer, performers, take.rating ? "★".repeat(take.rating) : "",
    take.video_bytes > 0 && t("video.of_take", { mb: megabytes(take) }), uncalibrated(take) && t("take.uncalibrated")];
  return h("p", { class: "when" }, take.recording ? t("take.recording") : parts.filter(Boolean).join("  ·  "));
}

/** Whether a take has no calibration in use: its cameras' places are unknown, so it cannot be solved yet. */
export const uncalibrated = (take) => take.cameras.length > 0 && !take.calibrated && !take.recording;

function mainAct(take, acts, job, more = "") {
  const [key, act] = uncalibrated(take) ? ["calibrate", acts.calibrate] : ["solve", acts.solve];
  const going = job?.kind === "calibrate" ? "calibration.busy" : "take.solving";
  return h("button", {
    class: `small ${more}`, type: "button", disabled: job !== undefined || take.recording, onclick: () => act(take),
    title: t(`take.${key}_with`), aria: { label: t(`take.${key}_label`, { name: take.name }) },
  }, t(job ? going : `take.${key}`));
}

function head(take, { acts, selected, job }) {
  return h("div", { class: "take-head" },
    h("input", {
      type: "checkbox", checked: selected, aria: { label: t("take.select", { name: take.name }) },
      onchange: (event) => acts.select(take, event.currentTarget.checked),
    }),
    h("span", { class: "name", title: take.id }, take.name),
    h("button", {
      class: `star ${take.starred ? "on" : ""}`, type: "button", aria: { label: t("take.star", { name: take.name }), pressed: String(Boolean(take.starred)) },
      onclick: () => acts.change(take, { starred: !take.starred }),
    }, take.starred ? "★" : "☆"),
    h("span", { class: "spacer" }),
    !take.recording && small("✎", t("take.edit_label", { name: take.name }), () => acts.edit(take), t("take.edit_hint"), { class: "small square" }),
    mainAct(take, acts, job));
}

/** Button that shows the beginning of an unfinished solve. */
function soFar(take, job) {
  const words = t("take.so_far", { done: tenths(job.so_far_s), of: tenths(job.of_s) });
  return h("button", { class: "small so-far", type: "button", onclick: () => open(take.id, job.name), title: t("take.so_far_hint") }, words);
}

/** Return the actions on the replayed take and on its shown solve. */
export function openTake(take, solve, { acts, job }) {
  const made = take.solves.includes(solve); // not what is still being made, nor what the cameras saw
  return [
    h("p", { class: "open-take-name" }, h("strong", { title: take.id }, take.name), h("span", { class: "muted" }, take.session)),
    line(take),
    h("div", { class: "buttons" },
      mainAct(take, acts, job, "primary"),
      made && h("button", { class: "small", type: "button", onclick: () => askExport([{ take, solve }]), aria: { label: t("take.export", { name: take.name, solve }) } }, t("export.short")),
      made && h("button", { class: "small", type: "button", onclick: () => askShare(take, solve), title: t("share.hint"), aria: { label: t("share.take", { name: take.name, solve }) } }, t("share.short"))),
    job && h("progress", { max: 1, value: job.progress, id: "open-progress", aria: { label: t("take.solving_label", { name: take.name }) } }),
  ].filter(Boolean);
}

/** Return the notes; of several lines the first is shown, and the others on a click. */
function notes(text) {
  const [first, ...others] = text.split("\n");
  if (!others.length) return h("p", { class: "muted notes" }, text);
  return h("details", { class: "muted notes" }, h("summary", {}, first), others.join("\n"));
}

/** Return the row of a take; `acts`: what its controls do; `shown`: the replayed `take|solve`, `job`: its job under way, `failed`: one that failed, `picture`: how many were made. */
export function takeRow(take, { acts, best, editing, failed, job, picture: made, selected, shown }) {
  return h("li", { "data-take": take.id, class: `take ${shown.startsWith(`${take.id}|`) ? "replayed" : ""}` },
    picture(take, best, made),
    h("div", { class: "take-body" },
      head(take, { acts, selected, job }),
      line(take),
      take.notes && notes(take.notes),
      take.tags.length > 0 && h("p", { class: "tags" }, take.tags.map((tag) => h("button", {
        class: "chip-button", type: "button", title: t("take.tag_hint", { tag }), onclick: () => acts.search(/\s/.test(tag) ? `tag:"${tag}"` : `tag:${tag}`),
      }, tag))),
      take.problem && h("p", { class: "fair" }, said(take.problem)),
      failed && !job && h("p", { class: "bad" }, t("take.failed", { solve: failed.name, reason: said(failed.message) })),
      job && h("progress", { max: 1, value: job.progress, id: `progress-${take.id}`, aria: { label: t("take.solving_label", { name: take.name }) } }),
      job?.of_s && soFar(take, job)),
    editing && slate(take, acts),
    take.solves.length > 0 && h("ul", { class: "solves" }, take.solves.map((solve) => solveRow(take, solve, acts, shown === `${take.id}|${solve}`))));
}
