// What a take without a solve contains, and the progress of a solve that is still being made, in words.
import { language, t } from "../base/strings.js";

/** Seconds with one decimal, as the language writes them. */
export const tenths = (seconds) => seconds.toLocaleString(language(), { minimumFractionDigits: 1, maximumFractionDigits: 1 });

/** Return the replay's `holds` in words: cameras with skeletons, cameras with depth, and whether they are calibrated. */
export function holdsWords({ skeletons, depth, calibrated }) {
  const images = Object.values(depth).reduce((sum, count) => sum + count, 0);
  const [seen, deep] = [Object.keys(skeletons).length, Object.keys(depth).length];
  return [
    seen ? t("replay.holds_skeletons", { n: seen }) : t("replay.holds_no_skeletons"),
    deep ? t("replay.holds_depth", { n: deep, images }) : "",
    !calibrated && seen + deep > 1 ? t("replay.holds_apart") : "",
  ].filter(Boolean).join(" · ");
}

/** Return how much of an unfinished solve is shown, from the replay's status. */
export const growingWords = ({ frames, rate_hz: rate, of_s: whole }) => t("replay.so_far", { done: tenths((frames - 1) / rate), of: tenths(whole) });
