// Help: the guide's topics and the keys in one dialog, with a search over both.
import { byId, h } from "../base/dom.js";
import { plain, t } from "../base/strings.js";
import { showPanel } from "./panels.js";

/** Topics in the order of the work, each with the panel title or the control that it is about. */
const TOPICS = {
  cameras: "cameras-title", phones: "cameras-title", calibrate: "calibration-title", tpose: "performer-title", record: "record", remote: "remote-link",
  replay: "takes-title", points: "view-layers", solve: "solve-title", compare: "takes-title", reference: "takes-title", blind: "takes-title",
  export: "takes-title", rig: "takes-title", share: "takes-title", outputs: "outputs-title", access: "access-title", undo: "undo",
  quality: "cameras-title",
};

function show(place) {
  byId("help").close();
  const target = byId(place);
  if (target.closest(".panel")) showPanel(place);
  const seen = target.querySelector("button") ?? target;
  seen.focus();
  seen.classList.add("pointed");
  setTimeout(() => seen.classList.remove("pointed"), 2500);
}

const isShown = (place) => Boolean(byId(place)?.closest(".panel, button, a")?.checkVisibility());

function topic(name, place) {
  return h("details", { class: "topic" }, h("summary", {}, t(`help.${name}`)), h("p", {}, t(`help.${name}.words`)),
    isShown(place) && h("button", { class: "small", type: "button", onclick: () => show(place) }, t("help.show")));
}

function shortcuts(groups) {
  return Object.entries(groups).map(([title, rows]) => h("section", {},
    h("h3", {}, t(`keys.${title}`)),
    h("dl", {}, rows.flatMap(([keys, what]) => [h("dt", {}, keys.split(" ").map((key) => h("kbd", {}, key))), h("dd", {}, t(`keys.${what}`))]))));
}

/** Show only what contains all typed words; matching topics are opened. */
function search(dialog, typed) {
  const words = plain(typed).split(/\s+/).filter(Boolean);
  const fits = (element) => words.every((word) => plain(element.textContent).includes(word));
  let found = 0;
  for (const item of dialog.querySelectorAll(".topic")) {
    item.hidden = !fits(item);
    item.open = words.length > 0 && !item.hidden;
    item.style.order = words.length && fits(item.querySelector("summary")) ? -1 : 0; // by its title: first
    found += !item.hidden;
  }
  for (const section of dialog.querySelectorAll(".shortcuts section")) {
    for (const term of section.querySelectorAll("dt")) {
      const whole = h("p", {}, `${term.textContent} ${term.nextElementSibling.textContent}`);
      term.hidden = term.nextElementSibling.hidden = !fits(whole);
    }
    section.hidden = !section.querySelector("dt:not([hidden])");
    found += !section.hidden;
  }
  const keys = dialog.querySelector(".shortcuts");
  keys.previousElementSibling.hidden = !keys.querySelector("section:not([hidden])");
  const nothing = dialog.querySelector(".empty");
  nothing.hidden = found > 0;
  nothing.textContent = t("help.nothing", { what: typed.trim() });
}

/** Open the help, or close it; `groups`: the keys, {title: [[keys, what]]}. */
export function toggleHelp(groups) {
  const dialog = byId("help");
  if (dialog.open) {
    dialog.close();
    return;
  }
  const field = h("input", { id: "help-search", type: "search", placeholder: t("help.search"), aria: { label: t("help.search") },
    oninput: (event) => search(dialog, event.currentTarget.value) });
  dialog.replaceChildren(h("h2", {}, t("help.title")), field,
    h("p", { class: "empty", role: "status", hidden: true }),
    h("div", { class: "topics" }, Object.entries(TOPICS).map(([name, place]) => topic(name, place))),
    h("h3", {}, t("keys.title")), h("div", { class: "shortcuts" }, shortcuts(groups)),
    h("form", { method: "dialog" }, h("button", { type: "submit" }, t("message.close"))));
  dialog.showModal();
  field.focus();
}
