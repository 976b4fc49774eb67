// A take in the list: picture, name, length, rating and star, its solves, and the form of its slate.
import { byId, clock, h } from "./dom.js";
import { askExport } from "./export.js";
import { open } from "./replay.js";
import { said } from "./said.js";
import { askShare } from "./sharing.js";
import { language, t } from "./strings.js";

const STARS = 5;
const MAX_NAME = 60, MAX_NOTES = 2000;

function when(iso) {
  const date = new Date(iso);
  if (Number.isNaN(date.getTime())) return "";
  const today = new Date().toDateString() === date.toDateString();
  const time = date.toLocaleTimeString(language, { hour: "2-digit", minute: "2-digit" });
  return today ? time : `${date.toLocaleDateString(language, { day: "numeric", month: "short" })} ${time}`;
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
    const values = { name: value("name"), performer: value("performer"), notes: value("notes"), rating: Number(value("rating")) };
    acts.edit(null);
    acts.change(take, values);
  };
  const field = (name, label, longest) => h("label", { class: "field" }, h("span", {}, label),
    h("input", { id: `slate-${name}`, type: "text", maxLength: longest, value: take[name] ?? "", required: name === "name" }));
  return h("form", { class: "slate", onsubmit: save, onkeydown: (event) => { if (event.key === "Escape") { event.stopPropagation(); acts.edit(null); } } },
    field("name", t("take.name"), MAX_NAME), field("performer", t("performer.title"), MAX_NAME), field("notes", t("take.notes"), MAX_NOTES),
    h("label", { class: "field" }, h("span", {}, t("take.rating")), h("select", { id: "slate-rating" },
      [...Array(STARS + 1).keys()].map((stars) => h("option", { value: stars, selected: stars === (take.rating ?? 0) }, stars ? "★".repeat(stars) : t("take.no_rating"))))),
    h("div", { class: "buttons" },
      h("button", { class: "small primary", type: "submit" }, t("message.save")),
      small(t("message.cancel"), t("message.cancel"), () => acts.edit(null)),
      h("span", { class: "spacer" }),
      small(t("take.throw"), t("take.throw_label", { name: take.name }), () => { acts.edit(null); acts.throwAway(take); }, t("take.throw_hint"))));
}

function picture(take, best, made) {
  const label = t("take.replay", { name: take.name, solve: best });
  const image = take.thumbnail && h("img", {
    src: `api/v1/takes/${take.id.split("/").map(encodeURIComponent).join("/")}/thumbnail?n=${made}`, alt: "", width: 56, height: 56, loading: "lazy",
  });
  if (!best) return h("span", { class: "take-picture none", aria: { hidden: "true" } }, take.recording ? "●" : "–");
  return h("button", { class: "take-picture", type: "button", title: label, aria: { label: t("take.open", { name: take.name }) }, onclick: () => open(take.id, best) },
    image, h("span", { class: "play", aria: { hidden: "true" } }, "▶"));
}

function line(take) {
  const parts = [take.seconds === null ? "" : clock(take.seconds), when(take.created), take.performer, take.rating ? "★".repeat(take.rating) : "", uncalibrated(take) && t("take.uncalibrated")];
  return h("p", { class: "when" }, take.recording ? t("take.recording") : parts.filter(Boolean).join("  ·  "));
}

/** A take that no calibration is in use of has no cameras' places yet: it cannot be solved before. */
const uncalibrated = (take) => take.cameras.length > 0 && !take.calibrated && !take.recording;

function mainAct(take, acts, job) {
  const [key, act] = uncalibrated(take) ? ["calibrate", acts.calibrate] : ["solve", acts.solve];
  const going = job?.kind === "calibrate" ? "calibration.busy" : "take.solving";
  return h("button", {
    class: "small", type: "button", disabled: job !== undefined || take.recording, onclick: () => act(take),
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

/** Return the row of a take; `shown`: `take|solve` that is replayed, `job`: its solve under way, `failed`: one that failed, `picture`: how many were made. */
export function takeRow(take, { acts, best, editing, failed, job, picture: made, selected, shown }) {
  return h("li", { class: `take ${shown.startsWith(`${take.id}|`) ? "replayed" : ""}` },
    picture(take, best, made),
    h("div", { class: "take-body" },
      head(take, { acts, selected, job }),
      line(take),
      take.notes && h("p", { class: "muted notes" }, take.notes),
      take.problem && h("p", { class: "fair" }, said(take.problem)),
      failed && !job && h("p", { class: "bad" }, t("take.failed", { solve: failed.name, reason: said(failed.message) })),
      job && h("progress", { max: 1, value: job.progress, id: `progress-${take.id}`, aria: { label: t("take.solving_label", { name: take.name }) } })),
    editing && slate(take, acts),
    take.solves.length > 0 && h("ul", { class: "solves" }, take.solves.map((solve) => solveRow(take, solve, acts, shown === `${take.id}|${solve}`))));
}
