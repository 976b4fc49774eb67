// Notice over the 3D view that it is drawn with fewer pixels than the screen has, without a graphics card.
import { byId, setText } from "../base/dom.js";
import { number, t } from "../base/strings.js";

let scale = null; // of the screen's pixels, by side; null: all are drawn, by a graphics card

function show() {
  const said = byId("resolution-said");
  said.hidden = scale === null || scale === 1;
  if (said.hidden) return;
  setText(said, t("resolution.reduced", { percent: number(100 * scale) }));
  said.title = t("resolution.hint");
}

/** Listen for the resolution of the 3D view. */
export function startResolution() {
  window.addEventListener("message", ({ origin, data }) => {
    if (origin !== location.origin || data?.type !== "resolution") return;
    ({ scale } = data);
    show();
  });
  window.addEventListener("language", show);
}
