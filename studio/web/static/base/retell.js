// Sources of the texts on the page, so that they are replaced in place when the language changes.
const MOST = 4000; // texts with values, the latest
const ATTRIBUTES = ["title", "aria-label", "placeholder", "alt", "label"];
const BETWEEN = /( {1,2}· {1,2}|: |; |, | \(|\))/; // texts that stand in one

const plain = new Map(), filled = new Map(); // text -> what says it in the language of now
const owns = new WeakMap(); // text node or element -> {attribute or "": {text, again}}

/** Note the function that makes a text again; `hasValues`: its kind may be unlimited in number. Return the text. */
export function remember(text, again, hasValues) {
  (hasValues ? plain : filled).delete(text);
  const map = hasValues ? filled : plain;
  map.delete(text);
  map.set(text, again);
  if (filled.size > MOST) filled.delete(filled.keys().next().value);
  return text;
}

const knownOf = (text) => plain.get(text) ?? filled.get(text);

/** Note that the text just made belongs to this text node, or attribute of an element: other texts may be identical. */
export function own(node, name, text) {
  const again = knownOf(text);
  if (again) owns.set(node, { ...owns.get(node), [name]: { text, again } });
}

/** Return a text in the current language; unchanged if its source is unknown. */
export function retold(text) {
  if (typeof text !== "string") return text;
  const again = knownOf(text);
  if (again) return again();
  const parts = text.split(BETWEEN);
  return parts.length > 1 ? parts.map((part) => knownOf(part)?.() ?? part).join("") : text;
}

function retell(node, name, text) {
  const mine = owns.get(node)?.[name];
  const words = mine?.text === text ? mine.again() : retold(text);
  if (words === text) return null;
  own(node, name, words);
  return words;
}

/** Replace all texts in an element by those in the current language; what is typed, open or chosen stays. */
export function retellAll(root) {
  const walker = document.createTreeWalker(root, NodeFilter.SHOW_ELEMENT | NodeFilter.SHOW_TEXT);
  for (let node = root; node; node = walker.nextNode()) {
    if (node.nodeType === Node.TEXT_NODE) {
      const words = node.data.trim() && !node.parentElement.closest("script, style") ? retell(node, "", node.data) : null;
      if (words !== null) node.data = words;
      continue;
    }
    for (const name of ATTRIBUTES) {
      const words = node.hasAttribute(name) ? retell(node, name, node.getAttribute(name)) : null;
      if (words !== null) node.setAttribute(name, words);
    }
  }
}
