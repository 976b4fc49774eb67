// Which takes the list shows: those that a search finds, the newest first, a page at a time; and others that are in use.
import { findTakes, getTakesOf } from "../base/api.js";

const PAGE = 60;
const KEPT = "takes-search";

const found = { search: sessionStorage.getItem(KEPT) ?? "", takes: [], others: [], count: 0, total: 0, reading: null, problem: "", asked: 0 };

/** What was found: `takes` so far, how many there are in all (`count`), takes without a search (`total`), how
 * many of them the server has read so far (`reading`, null where all), the `problem` of a search. */
export const foundTakes = () => found;

/** Return the take with an id, if it is known. */
export const takeOf = (id) => [...found.takes, ...found.others].find((take) => take.id === id);

/** Set the search, which applies from the next `loadFound` on. */
export function setSearch(text) {
  found.search = text;
  sessionStorage.setItem(KEPT, text);
  found.takes = found.takes.slice(0, PAGE);
}

/** Reload as many takes as are shown, and those of `ids` that are not among them; a newer call wins. Returns all known takes. */
export async function loadFound(ids) {
  const asked = found.asked += 1;
  let answer;
  try {
    answer = await findTakes({ search: found.search, limit: Math.max(PAGE, found.takes.length), offset: 0 });
  } catch (error) {
    if (!found.search || asked !== found.asked) throw error;
    found.problem = error.message; // what was found before stays until the search is understood
    return [...found.takes, ...found.others];
  }
  const total = answer.reading?.of ?? (found.search ? (await findTakes({ search: "", limit: 0, offset: 0 })).count : answer.count);
  const known = new Set(answer.takes.map((take) => take.id));
  const missing = [...new Set(ids)].filter((id) => !known.has(id));
  const others = missing.length ? await getTakesOf(missing) : [];
  if (asked === found.asked) Object.assign(found, { takes: answer.takes, count: answer.count, reading: answer.reading, total, others, problem: "" });
  return [...found.takes, ...found.others];
}

/** Load the next page. */
export async function loadMore() {
  const asked = found.asked;
  const { takes, count } = await findTakes({ search: found.search, limit: PAGE, offset: found.takes.length });
  if (asked !== found.asked) return;
  const known = new Set(found.takes.map((take) => take.id));
  Object.assign(found, { takes: [...found.takes, ...takes.filter((take) => !known.has(take.id))], count });
}
