// Calibration of a take on disk: from its own frames with what is known about its cameras, or as another take.
import { h } from "../base/dom.js";
import { findTakes, getBoards, getTakeDetail } from "../base/api.js";
import { ask, tell } from "../base/ask.js";
import { number, t } from "../base/strings.js";
import { boardFields, boardNow } from "../calibration/board.js";
import { knownFields, knownNow, seesNoDepth } from "../calibration/known.js";
import { reasonsOf, verdictCards } from "../calibration/verdict.js";

const ALIKE = 100; // takes of which one may be borrowed from, the newest first

/** Return calibrated takes that have the same cameras, the newest first. */
async function alikeTakes(take) {
  const cameras = take.cameras.map((name) => `camera:"${name}"`).join(" ");
  const { takes } = await findTakes({ search: `is:calibrated ${cameras}`, limit: ALIKE, offset: 0 });
  return takes.filter(({ id }) => id !== take.id);
}

const noBoard = (take, flat) => (flat.length < take.cameras.length ? t("board.depth") : take.video_bytes > 0 ? "" : t("board.no_videos"));

/** Ask how to calibrate a take; return `known`, the request to the server, and `before`, the number of the calibration in use; or null. */
export async function askCalibration(take) {
  const [alike, { meta }, boards] = await Promise.all([alikeTakes(take), getTakeDetail(take), getBoards()]);
  const flat = meta.cameras.filter((one) => seesNoDepth(one.joint_set)).map(({ name }) => name).sort();
  const known = h("div", { class: "known" });
  const show = () => known.replaceChildren(...(from.value || !flat.length ? [] : [...knownFields(flat, "take", show), boardFields(boards, noBoard(take, flat), show)]));
  const from = h("select", { id: "calibrate-from", onchange: show },
    [["", t("take.calibrate_own")], ...alike.map(({ id }) => [id, t("take.calibrate_as", { name: id })])].map(([value, text]) => h("option", { value }, text)));
  show();
  const wanted = () => (from.value ? { borrow: from.value } : { ...knownNow(flat), ...(flat.length && boardNow() && { board: boardNow() }) });
  const words = h("p", { class: "muted" }, t(take.calibrated ? "take.calibrate_again_words" : "take.calibrate_words"));
  const content = [words, h("label", { class: "field" }, h("span", {}, t("take.calibrate_from")), from), known];
  return ask(t("take.calibrate_label", { name: take.name }), content, t("calibration.start"), false, () => ({ known: wanted(), before: meta.calibration }));
}

/** Result of a calibration in words: how many cameras are good or usable, and the performer's height. */
export function calibrationWords(take, { calibration }) {
  const verdicts = Object.values(calibration.cameras).map(({ verdict }) => verdict);
  const counts = ["good", "usable"].map((verdict) => [verdicts.filter((one) => one === verdict).length, verdict]).filter(([n]) => n);
  const cameras = counts.map(([n, verdict]) => `${n} ${t(`calibration.verdict.${verdict}`)}`).join(", ");
  const tall = calibration.performer?.height_m;
  return [t("take.calibrated_as", { name: take.name, cameras }), tall && t("take.calibrated_tall", { m: number(tall, 2) })].filter(Boolean).join(" ");
}

/** Show what is wrong with a calibration, camera by camera, with what to do; nothing if all is good. */
export function showVerdicts(take, { calibration: { cameras, reference } }) {
  if (!reasonsOf(cameras).length) return;
  tell(t("take.calibration_of", { name: take.name }), h("ul", { class: "verdicts", tabIndex: 0 }, verdictCards(cameras, reference)));
}
