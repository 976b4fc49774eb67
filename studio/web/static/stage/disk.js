// What the operator must know about the disk and about a take that continued after a restart of the server.
import { byId, h, setText } from "../base/dom.js";
import { pin } from "../base/messages.js";
import { said } from "../base/said.js";
import { number, t } from "../base/strings.js";

const LOW_MINUTES = 20;
const banner = h("p", { id: "banner", class: "message banner", role: "status", hidden: true });
pin(banner);

function left(recording) {
  const minutes = recording.minutes_left;
  const time = minutes >= 120 ? t("disk.left_h", { hours: Math.floor(minutes / 60) }) : t("disk.left_min", { minutes: Math.floor(minutes) });
  return `${time} · ${t("disk.gb", { gb: number(recording.disk_free_gb, recording.disk_free_gb < 10 ? 1 : 0) })}`;
}

/** Show how long the disk lasts, and the notice of a take that continues after a restart. */
export function updateDisk({ recording, stale }) {
  const disk = byId("disk");
  setText(disk, stale ? "–" : left(recording));
  disk.classList.toggle("low", !stale && recording.minutes_left < LOW_MINUTES);
  banner.hidden = !recording.notice;
  setText(banner, said(recording.notice));
}
