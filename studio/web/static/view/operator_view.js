// Reports this page's look to the server as the operator's view, which other browsers can follow: of several pages of the
// operator the server takes the one that was moved last.
import { deleteOperatorView, putOperatorView } from "../base/api.js";
import { canOperate } from "../base/role.js";

const PAUSE_MS = 50;
const page = 1 + Math.floor(Math.random() * 2 ** 48); // two pages of the operator's are two

let next = null; // what the server is to be told
let telling = false;

/** Whether the operator's view is this page's, by page number. */
export const isOperatorView = (number) => number === page;

/** Report where this page looks from; `moved`: the operator moved it. `heard` gets whether this is the operator's view now. */
export async function tellOperatorView({ position, target, aspect }, moved, heard) {
  if (!canOperate()) return;
  next = { page, position_m: position, target_m: target, aspect, moved: moved || Boolean(next?.moved) };
  if (telling) return;
  telling = true;
  while (next) {
    const said = next;
    next = null;
    const answer = await putOperatorView(said).catch(() => null); // a server that is gone is told again when it is back
    if (answer) heard(isOperatorView(answer.page));
    await new Promise((resolve) => { setTimeout(resolve, PAUSE_MS); });
  }
  telling = false;
}

/** Report that this page was closed: its view can no longer be followed. */
export function closeOperatorView() {
  if (canOperate()) deleteOperatorView(page);
}
