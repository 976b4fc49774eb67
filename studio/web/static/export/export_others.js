// Other exports of a take's solve: the motion of a stored robot that follows it, or a prop of the take.
import { byId, h } from "../base/dom.js";
import { getOtherExports, makePropExport, makeRobotExport } from "../base/api.js";
import { t } from "../base/strings.js";
import { OF_SOLVES } from "./export_recipes.js";

const SEPARATOR = ":";
const PART = ["fps", "start_s", "end_s", "smooth_hz"];

/** Options of each kind, besides the format. */
const OPTIONS = { robot: [...PART, "performer", "balance", "keep_pose"], prop: [...PART, "interpolation", "key_error_cm", "rotation_order", "unit"] };
const FORMATS = { robot: ["csv", "npz"], prop: OF_SOLVES };

/** Options that only robots have. */
export const OF_ROBOTS = ["balance", "keep_pose"];

/** Return what is exported, "" for the performer, else `robot` or `prop`; and its name. */
export function otherChosen() {
  const [kind = "", ...name] = (byId("export-what")?.value ?? "").split(SEPARATOR);
  return { kind, name: name.join(SEPARATOR) };
}

/** Whether the kind of export has an option, regardless of the format. */
export const hasOption = (id, { kind }) => (kind ? OPTIONS[kind].includes(id) : !OF_ROBOTS.includes(id));

/** Whether the kind of export can be written in a format. */
export const hasFormat = (format, { kind }) => !kind || FORMATS[kind].includes(format);

/** Return the key of a format's words: a robot's files have different content. */
export const formatWords = (format, { kind }) => `export.format.${kind === "robot" && FORMATS.robot.includes(format) ? "robot." : ""}${format}`;

/** Return the choice, hidden until there is something else to export. */
export const otherField = (changed) => h("label", { class: "field", hidden: true }, h("span", {}, t("export.what")),
  h("select", { id: "export-what", onchange: changed }, h("option", { value: "" }, t("export.what.performer"))));

/** Offer the robots and props of a single take. */
export async function offerOthers(jobs) {
  if (jobs.length !== 1) return;
  const { robots, props } = await getOtherExports(jobs[0].take.id), choice = byId("export-what");
  const option = (kind) => (name) => h("option", { value: `${kind}${SEPARATOR}${name}` }, t(`export.what.${kind}`, { name }));
  choice.append(...robots.map(option("robot")), ...props.map(option("prop")));
  choice.closest(".field").hidden = choice.options.length < 2;
}

/** Start the export; the request is as for the performer's own. */
export function makeOther({ kind, name }, { solves: [{ take, solve }], format, ...options }) {
  const mine = Object.fromEntries(Object.entries(options).filter(([id]) => OPTIONS[kind].includes(id)));
  return (kind === "robot" ? makeRobotExport : makePropExport)({ take, solve, format, [kind]: name, ...mine });
}
