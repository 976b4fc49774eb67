// The export dialog: target program, format and options, a rig, one take or several; made in the background, then downloaded.
import { byId, h, setText } from "../base/dom.js";
import { downloadExport, getExportFormats, makeDepthExport, makeExport } from "../base/api.js";
import { cameraField, depthCameras, depthWords } from "./export_depth.js";
import { DEPTH, FORMATS, KEYS, ORDERS, RATES, RECIPES, RIG_FORMATS, ROOTS, SCENES, TARGETS, UNDERSTOOD, UNITS, recipeOf } from "./export_recipes.js";
import { OF_ROBOTS, formatWords, hasFormat, hasOption, makeOther, offerOthers, otherChosen, otherField } from "./export_others.js";
import { RigChoice } from "./export_rig.js";
import { ended } from "../base/jobs.js";
import { attempt, showNote } from "../base/messages.js";
import { namesOf, performerWords } from "../replay/performers.js";
import { replayed } from "../replay/replay.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";

const KEPT = "export";
const REMEMBERED = ["recipe", "format", "target", "fps", "root_motion", "interpolation", "mesh", "rotation_order", "unit", "rig"];
const TOGETHER = "together";
const NUMBERS = ["fps", "start_s", "end_s", "smooth_hz", "key_error_cm"];
const CHECKS = ["mesh", "foot_lock", "loop"];

const state = { jobs: [], recipe: "", rig: null, running: false, missing: new Map() };

const field = (id) => byId(`export-${id}`);

function select(id, values, words, chosen, onchange) {
  return h("label", { class: "field" }, h("span", {}, t(`export.${id}`)), h("select", { id: `export-${id}`, onchange },
    values.map((value) => h("option", { value, selected: String(value) === String(chosen ?? values[0]) }, words(value)))));
}

const number = (id, value, placeholder) => h("label", { class: "field", title: t(`export.${id}.hint`) }, h("span", {}, t(`export.${id}`)),
  h("input", { id: `export-${id}`, type: "number", min: 0, step: "any", value: value ?? "", placeholder }));

const check = (id, checked) => h("label", { class: "check", title: t(`export.${id}.hint`) }, h("input", { id: `export-${id}`, type: "checkbox", checked: Boolean(checked), onchange: showFields }), t(`export.${id}`));

/** Return the part between the in and out points, if a single take is exported and it is being replayed. */
function trim() {
  const replay = replayed();
  if (state.jobs.length !== 1 || !replay.open || replay.take !== state.jobs[0].take.id) return {};
  return { start: replay.first > 0 ? (replay.first / replay.rate_hz).toFixed(2) : undefined,
    end: replay.last < replay.frames - 1 ? (replay.last / replay.rate_hz).toFixed(2) : undefined };
}

function recipes() {
  return h("fieldset", { class: "recipes" }, h("legend", {}, t("export.for")),
    Object.keys(RECIPES).map((name) => h("label", { class: "recipe" },
      h("input", { class: "sr", type: "radio", name: "export-recipe", value: name, checked: name === state.recipe, onchange: () => useRecipe(name) }),
      h("strong", {}, t(`recipe.${name}`)), h("span", { class: "muted" }, t(`recipe.${name}.what`)))));
}

/** Fill in the fields for a program. */
function useRecipe(name) {
  state.recipe = name;
  for (const [id, value] of Object.entries(RECIPES[name])) {
    const control = field(id);
    if (control.type === "checkbox") control.checked = value;
    else control.value = value;
  }
  rigChanged();
}

/** Select the rig's own format for an export onto a rig; another may be chosen after that. */
function rigChanged() {
  const kind = state.rig.name.split(".").pop();
  if (onRig() && RIG_FORMATS.includes(kind)) field("format").value = kind;
  showFields();
}

/** Handle a format chosen directly: keep the recipe if it fits, else select the one with this format, or none. */
function formatChosen() {
  const format = field("format").value;
  const fits = state.recipe === "rig" ? RIG_FORMATS.includes(format) : RECIPES[state.recipe]?.format === format;
  if (!fits) state.recipe = recipeOf(format);
  for (const input of byId("export-dialog").querySelectorAll("[name=export-recipe]")) input.checked = input.value === state.recipe;
  showFields();
}

const onRig = () => state.recipe === "rig" && !otherChosen().kind;

/** Return the performers if a single take with several is exported: `[performer, name]`. */
function performers() {
  if (state.jobs.length !== 1) return [];
  const { take } = state.jobs[0], several = take.performers, names = namesOf(take);
  return several.length > 1 ? several.map((one) => [one, performerWords(names[one] ?? one)]) : [];
}

/** Return the choice of performers: the values are performers, "" for one file each, and `TOGETHER`. */
function performerField() {
  const choices = performers();
  if (!choices.length) return null;
  const options = [["", t("performers.each")], [TOGETHER, t("performers.together")], ...choices];
  return h("label", { class: "field" }, h("span", {}, t("performers.of_export")), h("select", { id: "export-performer", onchange: showFields },
    options.map(([value, words]) => h("option", { value }, words))));
}

/** Disable, but show, the formats that do not fit the export or cannot be written here. */
function markFormats() {
  const choice = field("format"), other = otherChosen();
  const usable = (name) => !state.missing.has(name) && hasFormat(name, other);
  for (const option of choice.options) {
    option.disabled = !usable(option.value);
    option.title = state.missing.get(option.value) ?? "";
    setText(option, t(formatWords(option.value, other)));
  }
  field("missing").hidden = !state.missing.size || Boolean(other.kind);
  if (!usable(choice.value)) choice.value = [...choice.options].find(({ value }) => usable(value)).value;
}

/** Handle that something else is to be exported. */
function otherChanged() {
  markFormats();
  showFields();
}

const understood = (id, format) => hasOption(id, otherChosen()) && (!(id in UNDERSTOOD) || UNDERSTOOD[id].includes(format));

/** Show the fields that apply to the export and its format. */
function showFields() {
  const format = field("format").value, other = otherChosen();
  const all = field("performer")?.querySelector(`[value="${TOGETHER}"]`);
  if (all) {
    all.disabled = onRig() || Boolean(other.kind) || !SCENES.includes(format);
    if (all.disabled && field("performer").value === TOGETHER) field("performer").value = "";
  }
  for (const id of [...Object.keys(UNDERSTOOD), ...OF_ROBOTS]) {
    const owned = onRig() && ["target", "mesh", "unit"].includes(id);
    const holder = field(id)?.closest(".field, .check");
    if (holder) holder.hidden = owned || !understood(id, format);
  }
  byId("export-dialog").querySelector(".recipes").hidden = Boolean(other.kind);
  byId("export-rig-section").hidden = !onRig();
  field("advanced").hidden = format === DEPTH;
  field("depth").hidden = format !== DEPTH;
  const nothing = onRig() ? !state.rig.ready : format === DEPTH && !depthCameras(state.jobs).length;
  if (nothing) field("camera").closest(".field").hidden = true;
  field("run").disabled = state.running || nothing;
}

function takesList() {
  if (state.jobs.length === 1) return null;
  return h("div", { class: "batch" },
    h("ul", {}, state.jobs.map((job) => h("li", {}, h("span", { class: "name", title: job.take.id }, job.take.name),
      h("select", { aria: { label: t("export.solve_of", { name: job.take.name }) }, onchange: (event) => { job.solve = event.currentTarget.value; } },
        job.take.solves.map((solve) => h("option", { value: solve, selected: solve === job.solve }, solve)))))),
    check("together", false));
}

function advanced(kept) {
  return h("details", { class: "advanced", id: "export-advanced" }, h("summary", {}, t("export.advanced")),
    h("div", { class: "grid" },
      select("target", TARGETS, (name) => t(`export.target.${name}`), kept.target),
      select("root_motion", ROOTS, (name) => t(`export.root.${name}`), kept.root_motion),
      select("interpolation", KEYS, (name) => t(`export.keys.${name}`), kept.interpolation),
      number("key_error_cm", "", t("export.off")),
      select("rotation_order", ORDERS, (name) => name, kept.rotation_order),
      select("unit", UNITS, (name) => name, kept.unit),
      h("label", { class: "field", title: t("export.timecode.hint") }, h("span", {}, t("export.timecode")), h("input", { id: "export-timecode", type: "text", placeholder: "hh:mm:ss:ff, take", pattern: "take|\\d\\d:\\d\\d:\\d\\d[:;]\\d\\d", value: "" })),
      ...["part_from", "part_to"].map((id) => h("label", { class: "field", title: t("export.part.hint") }, h("span", {}, t(`export.${id}`)),
        h("input", { id: `export-${id}`, type: "text", placeholder: "hh:mm:ss:ff", pattern: "\\d\\d:\\d\\d:\\d\\d[:;]\\d\\d", value: "" }))),
      number("smooth_hz", "", t("export.off"))),
    h("div", { class: "checks" }, check("foot_lock"), check("loop")));
}

function fields(kept) {
  const { start, end } = trim();
  return [
    takesList(), otherField(otherChanged), recipes(),
    h("div", { id: "export-rig-section" }, state.rig.element),
    h("div", { class: "grid" },
      select("format", FORMATS, (name) => t(`export.format.${name}`), kept.format ?? "fbx", formatChosen),
      select("fps", RATES, (rate) => (rate ? t("export.fps.value", { rate }) : t("export.fps.as_solved")), kept.fps),
      performerField(), cameraField(state.jobs),
      number("start_s", start, t("export.start_s.none")), number("end_s", end, t("export.end_s.none"))),
    h("p", { id: "export-depth", class: "muted hint", hidden: true }, depthWords(state.jobs)),
    h("ul", { id: "export-missing", class: "muted hint", hidden: true }),
    h("div", { class: "checks" }, check("mesh", kept.mesh), OF_ROBOTS.map((id) => check(id, false))),
    advanced(kept),
  ].filter(Boolean);
}

/** Disable, but show, the formats that cannot be written, each with its reason and the remedy. */
async function findFormats() {
  const missing = new Map((await getExportFormats()).filter((one) => one.missing).map((one) => [one.format, said(one.missing)]));
  if (!depthCameras(state.jobs).length) missing.set(DEPTH, depthWords(state.jobs));
  state.missing = missing;
  markFormats();
  for (const input of byId("export-dialog").querySelectorAll("[name=export-recipe]")) input.disabled = missing.has(RECIPES[input.value].format);
  field("missing").replaceChildren(...[...missing].map(([name, words]) => h("li", {}, name === DEPTH ? words : t("export.missing", { format: name.toUpperCase(), missing: words }))));
  showFields();
}

/** Return the request to the API. */
function chosen() {
  const format = field("format").value;
  const has = (id) => understood(id, format);
  const request = { format, solves: state.jobs.map(({ take, solve }) => ({ take: take.id, solve })) };
  for (const id of NUMBERS) if (has(id) && field(id).value !== "") request[id] = Number(field(id).value);
  for (const id of ["target", "root_motion", "interpolation", "rotation_order", "unit", "timecode", "part_from", "part_to"]) {
    if (has(id) && field(id).value !== "") request[id] = field(id).value;
  }
  for (const id of [...CHECKS, ...OF_ROBOTS]) if (has(id)) request[id] = field(id).checked;
  if (has("together") && field("together")?.checked) request.together = true;
  const performer = field("performer")?.value;
  if (performer === TOGETHER) request.together = true;
  else if (performer) request.performer = performer;
  if (onRig()) {
    request.rig = state.rig.name;
    for (const id of ["target", "mesh", "unit"]) delete request[id];
  }
  return request;
}

/** Keep the settings for the next export, but not those of depth, robots or props. */
function keep(request) {
  if (request.format === DEPTH || otherChosen().kind) return;
  const kept = { ...request, recipe: state.recipe };
  localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(REMEMBERED.map((key) => [key, kept[key]]))));
}

async function run(event) {
  event.preventDefault();
  const request = chosen();
  keep(request);
  const bar = byId("export-progress");
  const words = byId("export-words");
  state.running = true;
  showFields();
  bar.hidden = words.hidden = false;
  bar.removeAttribute("value");
  const made = await attempt(async () => {
    const other = otherChosen();
    const asked = request.format === DEPTH ? makeDepthExport(state.jobs[0].take.id, field("camera").value)
      : other.kind ? makeOther(other, request) : makeExport(request);
    const job = await ended(await asked, (share) => { if (share !== null) bar.value = share; });
    await save(job);
    return job;
  });
  state.running = false;
  bar.hidden = words.hidden = true;
  showFields();
  if (made) {
    byId("export-dialog").close();
    showNote(t("export.done", { n: request.solves.length, name: made.name }));
  }
}

async function save(job) {
  const file = await downloadExport(job.id);
  const link = h("a", { href: URL.createObjectURL(file), download: job.name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
}

/** Ask how to export solves, `[{take, solve}]`, and download the result. */
export function askExport(jobs) {
  const dialog = byId("export-dialog");
  if (!state.running) {
    const kept = JSON.parse(localStorage.getItem(KEPT) ?? "{}");
    state.jobs = jobs.map((job) => ({ ...job }));
    state.recipe = kept.recipe ?? "motionbuilder";
    state.rig = new RigChoice(rigChanged);
    const title = jobs.length === 1 ? t("export.one", { take: jobs[0].take.name, solve: jobs[0].solve }) : t("export.many", { n: jobs.length });
    dialog.replaceChildren(h("h2", {}, title),
      h("form", { class: "export-form", onsubmit: run }, ...fields(kept),
        h("div", { class: "foot" },
          h("p", { id: "export-words", class: "muted hint", hidden: true }, t("export.background")),
          h("progress", { id: "export-progress", max: 1, hidden: true, aria: { label: t("export.progress") } }),
          h("div", { class: "buttons" },
            h("button", { id: "export-run", class: "primary", type: "submit" }, t("export.short")),
            h("button", { type: "button", onclick: () => dialog.close() }, t("message.close"))))));
    showFields();
    attempt(findFormats);
    attempt(() => offerOthers(state.jobs));
    state.rig.open(kept.rig);
  }
  dialog.showModal();
}
