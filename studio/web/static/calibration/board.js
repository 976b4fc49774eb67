// Fields for a board visible in a take's videos, with sheets to print: it gives cameras without depth the scale of the stage.
import { byId, h } from "../base/dom.js";
import { said } from "../base/said.js";
import { t } from "../base/strings.js";

const TAGS = 4; // sheets that are offered; any number of tags may lie there
const board = { kind: "", tag: 160, family: "36h11", columns: 5, rows: 7, square: 38, marker: 28, dictionary: "4x4_50" };

/** Return the board in the form of the request; undefined: none. */
export const boardNow = () => (board.kind ? boardText() : undefined);

function boardText() {
  const { kind, tag, family, columns, rows, square, marker, dictionary } = board;
  return kind === "apriltag" ? `apriltag:${tag}:${family}` : `charuco:${columns}x${rows}:${square}:${marker}:${dictionary}`;
}

function numberField(name, props) {
  return h("label", { class: "pair" }, t(`board.${name}`), h("input", {
    id: `board-${name}`, type: "number", required: true, value: board[name], ...props,
    oninput: (event) => { board[name] = Number(event.currentTarget.value); },
  }));
}

function choiceField(name, values) {
  return h("label", { class: "pair" }, t(`board.${name}`), h("select", {
    id: `board-${name}`, onchange: (event) => { board[name] = event.currentTarget.value; },
  }, values.map((one) => h("option", { value: one, selected: one === board[name] }, one))));
}

/** Return a button that opens a sheet of the board as entered at the time of the click. */
function sheet(text, number) {
  const print = () => {
    if (byId("board").closest("form").reportValidity()) window.open(`api/v1/boards/${encodeURIComponent(boardText())}?number=${number}`, "_blank", "noopener");
  };
  return h("button", { type: "button", class: "small", onclick: print }, text);
}

const size = { min: 5, max: 5000, step: "any" }, squares = { min: 3, max: 50, step: 1 };

function fields({ families, dictionaries }) {
  if (board.kind === "apriltag") return [numberField("tag", size), choiceField("family", families),
    [...Array(TAGS).keys()].map((n) => sheet(t("board.print_tag", { n }), n))].flat();
  return [numberField("columns", squares), numberField("rows", squares), numberField("square", size), numberField("marker", size),
    choiceField("dictionary", dictionaries), sheet(t("board.print"), 0)];
}

/** Return the choice of a board and its fields; `why`: the reason why no board is possible, in words. */
export function boardFields(boards, why, changed) {
  const reason = why || (boards.missing && said(boards.missing));
  if (reason) board.kind = "";
  const choose = h("select", { id: "board", disabled: Boolean(reason), onchange: (event) => { board.kind = event.currentTarget.value; changed(); } },
    ["", "apriltag", "charuco"].map((kind) => h("option", { value: kind, selected: kind === board.kind }, t(`board.${kind || "none"}`))));
  return h("fieldset", { class: "board" }, h("label", { class: "pair" }, t("board.label"), choose), board.kind && fields(boards),
    (reason || board.kind) && h("p", {}, reason || t("board.words")));
}
