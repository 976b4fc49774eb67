// Rigid bodies of the replayed take: what each is, and how those on joints are placed, measured against its solve.
import { byId, h, redraw } from "../base/dom.js";
import { changeBody, getBodies, measureBodies } from "../base/api.js";
import { attempt } from "../base/messages.js";
import { number, t } from "../base/strings.js";
import { bodyRow, heldWords, jointWords, shapeWords } from "../stage/body_row.js";

const panel = { id: "", solve: "", found: null, again: () => {} };

/** Run a request that returns the take's bodies, and show them, in the replay too. */
const alter = (act) => attempt(async () => {
  panel.found = await act(panel.id);
  draw();
  if (panel.id) await panel.again(); // the replay may have been closed meanwhile
});

function say(name, known, changes) {
  const { use = "prop", joint = "", performer = "performer_1", shape = null } = known ?? {};
  return alter((take) => changeBody(take, { name, use, joint, performer, shape: shapeWords(shape), ...changes }));
}

/** Return how solves and exports use a body, in words. */
function outcome(known, residual) {
  if (known?.use === "prop") return heldWords(known);
  if (!known?.joint) return "";
  if (residual === null) return t("bodies.not_measured");
  return t(`bodies.${known.use}`, { joint: jointWords(known.joint), mm: number(residual, 0) });
}

function draw() {
  const bodies = panel.found?.bodies ?? [];
  byId("bodies-panel").hidden = !bodies.length;
  byId("bodies-count").textContent = bodies.length ? String(bodies.length) : "";
  const onJoints = bodies.some(({ known }) => known?.joint && known.use !== "prop");
  redraw(byId("bodies"), [panel.id, panel.solve, panel.found], () => [
    panel.found?.outdated && h("p", { class: "fair" }, t("bodies.outdated")),
    h("ul", { class: "triggers" }, bodies.map(({ name, readings, known, residual_mm: residual }) => bodyRow(name, {
      seen: t("bodies.readings", { n: readings }), known, below: outcome(known, residual), say: (changes) => say(name, known, changes),
    }))),
    onJoints && panel.solve && h("button", {
      id: "bodies-measure", class: "small operate", type: "button", title: t("bodies.measure_hint"),
      onclick: () => alter((take) => measureBodies(take, { solve: panel.solve })),
    }, t("bodies.measure", { solve: panel.solve })),
  ].filter(Boolean));
}

/** Update to what is replayed. */
export function updateBodies({ open, take, solve }) {
  const id = open ? take : "";
  panel.solve = open ? solve : "";
  if (id === panel.id) return draw();
  Object.assign(panel, { id, found: null });
  draw();
  if (id) attempt(async () => {
    const found = await getBodies(panel.id);
    if (panel.id === id) panel.found = found;
    draw();
  });
}

/** Start; `again()` reopens the replay. */
export function startBodies(again) {
  panel.again = again;
  window.addEventListener("language", draw);
}
