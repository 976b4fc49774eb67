// What a take without a solve holds, in words.
import { t } from "../base/strings.js";

/** Return the words of `holds` of the replay: skeletons and depth by camera, and whether the cameras have places. */
export function holdsWords({ skeletons, depth, calibrated }) {
  const images = Object.values(depth).reduce((sum, count) => sum + count, 0);
  const [seen, deep] = [Object.keys(skeletons).length, Object.keys(depth).length];
  return [
    seen ? t("replay.holds_skeletons", { n: seen }) : t("replay.holds_no_skeletons"),
    deep ? t("replay.holds_depth", { n: deep, images }) : "",
    !calibrated && seen + deep > 1 ? t("replay.holds_apart") : "",
  ].filter(Boolean).join(" · ");
}
