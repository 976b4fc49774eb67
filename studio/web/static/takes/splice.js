// Splice takes: a dialog with the parts in their order, their blend time, and the name of the new take.
import { h } from "../base/dom.js";
import { spliceTakes } from "../base/api.js";
import { ask } from "../base/ask.js";
import { ended } from "../base/jobs.js";
import { attempt, showNote } from "../base/messages.js";
import { t } from "../base/strings.js";

const BLEND_S = 0.8;

function seconds(label, value, attributes = {}) {
  const input = h("input", { type: "number", step: "any", min: 0, value, ...attributes });
  return [input, h("label", { class: "field" }, h("span", {}, label), input)];
}

/** Return one part: its take and the fields of its times; empty fields mean the whole take. */
function partOf({ take, solve, performer, start_s: start = "", end_s: end = "" }) {
  const [from, fromField] = seconds(t("splice.from"), start, { aria: { label: `${t("splice.from")}, ${take.name}` } });
  const [to, toField] = seconds(t("splice.to"), end, { aria: { label: `${t("splice.to")}, ${take.name}` } });
  const row = h("li", {}, h("span", { class: "splice-take" }, `${take.name} (${solve})`), fromField, toField);
  const read = () => ({
    take: take.id, solve, since_begin: true,
    start_s: from.value === "" ? null : from.valueAsNumber, end_s: to.value === "" ? null : to.valueAsNumber, ...(performer && { performer }),
  });
  return { row, read };
}

/** Button that moves a part one place earlier. */
function earlier(parts, part, list) {
  return h("button", { type: "button", class: "small square quiet", title: t("splice.earlier"), aria: { label: t("splice.earlier") }, onclick: () => {
    const k = parts.indexOf(part);
    if (k < 1) return;
    parts.splice(k - 1, 2, part, parts[k - 1]);
    list.replaceChildren(...parts.map((one) => one.row));
  } }, "↑");
}

/**
 * Ask how to splice parts `{take, solve, performer?, start_s?, end_s?}` (times since the solve's beginning), and do it;
 * `times`: how often they repeat, for a loop.
 */
export async function askSplice(given, times = 1) {
  const parts = given.map(partOf), list = h("ol", { class: "splice-parts" });
  if (parts.length > 1) for (const part of parts) part.row.append(earlier(parts, part, list));
  list.append(...parts.map((part) => part.row));
  const [first] = given;
  const [blend, blendField] = seconds(t("splice.blend"), BLEND_S, { max: 10, id: "splice-blend" });
  const [often, oftenField] = seconds(t("splice.times"), times, { min: 1, max: 100, step: 1, id: "splice-times" });
  const name = h("input", { id: "splice-name", type: "text", required: true, maxLength: 60, autocomplete: "off", spellcheck: false, value: `${first.take.name}_${parts.length > 1 ? "spliced" : "loop"}` });
  const content = [
    h("p", { class: "muted hint" }, t("splice.hint")), list,
    h("div", { class: "edit-fields" }, blendField, oftenField),
    h("label", { class: "field" }, h("span", {}, t("splice.name")), name),
  ];
  const said = await ask(t(parts.length > 1 ? "splice.title" : "splice.loop_title"), content, t(parts.length > 1 ? "selected.splice" : "mend.loop"), false, () => ({
    take: `${first.take.session}/${name.value.trim()}`, parts: parts.map((part) => part.read()), times: often.valueAsNumber, blend_s: blend.valueAsNumber,
  }));
  if (!said) return;
  await attempt(async () => {
    await ended(await spliceTakes(said));
    showNote(t("splice.done", { name: name.value.trim() }));
  });
}
