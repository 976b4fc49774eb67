// Import from the page: files and folders that are dropped anywhere or chosen are sent, and become takes.
import { announceImports, sendImport, sendReference } from "../base/api.js";
import { byId, h, setText } from "../base/dom.js";
import { ended } from "../base/jobs.js";
import { attempt, showError, showNote } from "../base/messages.js";
import { canOperate } from "../base/role.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";
import { safeName } from "../compare/reference.js";
import { insideView } from "../view/viewer.js";
import { chosenFiles, droppedFiles } from "./given_files.js";

const REFERENCES = [".bvh", ".fbx", ".glb", ".gltf", ".c3d", ".trc", ".csv", ".npz"];
const WAYS = ["auto", "audio", "clap", "timecode", "motion", "none"];
const LAST_WORD_MS = 5000; // why sending has failed is told by the server soon, or not at all
const state = { sending: 0, imported: () => {} };

const later = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

/** Send an import's files; an error that the server explains is left to the job. */
async function send(job, files) {
  const leaving = new AbortController();
  const end = ended(job);
  end.catch(() => leaving.abort());
  try {
    await sendImport(job.id, new Blob(files.map(({ file }) => file)), leaving.signal);
  } catch {
    await Promise.race([end, later(LAST_WORD_MS)]);
    throw new Error(t("import.lost", { name: job.name }));
  }
  return end;
}

async function bring({ job, robot }, files) {
  try {
    if (job.state === "failed") throw new Error(said(job.message));
    const done = await send(job, files);
    showNote(robot ? t("import.robot_done", { names: done.name }) : t("import.done", { name: job.name, take: done.take }));
    if (!robot) state.imported(done.take);
  } catch (error) {
    if (error.name === "AbortError") showNote(error.message);
    else showError(t("import.failed", { name: job.name, reason: error.message }));
  }
}

/** Return the typed times of claps: seconds, or camera=second, with commas or spaces between. */
const clapsNow = () => (byId("import-clap")?.value ?? "").split(/[,;\s]+/).filter(Boolean);

/** Import `[{path, file}]`: one import after the other is sent and read. */
export function importFiles(files) {
  return attempt(async () => {
    if (!files.length) throw new Error(t("import.nothing"));
    const { imports } = await announceImports(files.map(({ path, file }) => ({ path, size: file.size })), byId("import-sync")?.value, clapsNow());
    const going = imports.filter(({ job }) => job.state !== "failed").length;
    if (going) showNote(t("import.sending", { n: going }));
    state.sending += 1;
    try {
      for (const one of imports) await bring(one, one.files.map((index) => files[index]));
    } finally {
      state.sending -= 1;
    }
  });
}

/** Row of the take under the pointer, to which a dropped file may be added as a reference. */
const rowAt = (event) => event.target.closest?.(".take[data-take]") ?? null;

const isReference = (files) => files.length === 1 && !files[0].path.includes("/") && REFERENCES.some((ending) => files[0].path.toLowerCase().endsWith(ending));

async function addReference(takeId, { path, file }) {
  await attempt(async () => {
    const { name } = await sendReference(takeId, safeName(path), file);
    showNote(t("import.reference_added", { name, take: takeId }));
  });
}

function showVeil(shown, row = null) {
  document.body.classList.toggle("dropping", shown);
  for (const one of document.querySelectorAll(".take.drop-here")) if (one !== row) one.classList.remove("drop-here");
  row?.classList.add("drop-here");
  byId("drop-veil").hidden = !shown;
  if (shown) setText(byId("drop-words"), row ? t("import.drop_reference", { name: row.dataset.take }) : t("import.drop_words"));
}

const brings = (event) => canOperate() && [...(event.dataTransfer?.types ?? [])].includes("Files") && !document.querySelector("dialog:modal:not(#import-dialog)");

function over(event) {
  if (!brings(event) || event.target.closest?.(".drop")) {
    showVeil(false);
    return;
  }
  event.preventDefault();
  event.dataTransfer.dropEffect = "copy";
  showVeil(true, rowAt(event));
}

async function dropped(event) {
  const row = rowAt(event);
  showVeil(false);
  if (!brings(event) || event.defaultPrevented) return;
  event.preventDefault();
  byId("import-dialog").close();
  const found = await attempt(() => droppedFiles(event.dataTransfer));
  if (!found) return;
  if (row?.dataset.take && isReference(found)) await addReference(row.dataset.take, found[0]);
  else await importFiles(found);
}

/** Listen for drags over a page: this one, or the 3D view, which is a page of its own. */
function listenTo(target) {
  target.addEventListener("dragenter", over);
  target.addEventListener("dragover", over);
  target.addEventListener("drop", dropped);
  target.addEventListener("dragleave", (event) => { if (!event.relatedTarget) showVeil(false); });
}

function fileField(id, folder) {
  const field = h("input", {
    id, class: "sr", type: "file", multiple: true, tabIndex: -1, aria: { hidden: "true" }, onchange: (event) => {
      const files = chosenFiles(event.currentTarget);
      event.currentTarget.value = "";
      byId("import-dialog").close();
      importFiles(files);
    },
  });
  field.webkitdirectory = folder;
  return field;
}

function kinds(key) {
  return [h("dt", {}, t(`import.${key}`)), h("dd", {}, t(`import.${key}_kinds`))];
}

function build() {
  const choose = (id, key, props) => h("button", { type: "button", onclick: () => byId(id).click(), ...props }, t(key));
  return [
    h("h2", {}, t("import.title")),
    h("div", { class: "buttons" }, choose("import-files", "import.files", { class: "primary", id: "import-choose-files", autofocus: true }), choose("import-folder", "import.folder", { id: "import-choose-folder" })),
    fileField("import-files", false), fileField("import-folder", true),
    h("label", { class: "field", title: t("import.sync_hint") }, h("span", {}, t("import.sync")), h("select", { id: "import-sync" }, WAYS.map((way) => h("option", { value: way }, t(`import.sync_${way}`))))),
    h("label", { class: "field", title: t("import.clap_hint") }, h("span", {}, t("import.clap")), h("input", { id: "import-clap", type: "text", placeholder: "3.5", maxLength: 500, spellcheck: false, autocomplete: "off" })),
    h("p", { class: "muted" }, t("import.words")),
    h("dl", {}, ["recordings", "animations", "takes", "robots"].flatMap(kinds)),
    h("form", { method: "dialog" }, h("button", { type: "submit" }, t("message.close"))),
  ];
}

/** Connect the button and the page; `imported` gets the id of an imported take. */
export function startImport(imported) {
  state.imported = imported;
  const dialog = byId("import-dialog");
  byId("import-open").addEventListener("click", () => {
    if (!dialog.firstChild) dialog.append(...build());
    dialog.showModal();
  });
  listenTo(document);
  insideView(listenTo);
  addEventListener("beforeunload", (event) => { if (state.sending) event.preventDefault(); });
}
