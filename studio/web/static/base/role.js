// The user of this page: the operator, or a viewer, who sees all and changes nothing.
const asked = new URLSearchParams(location.search).has("view");

let role = "operator";

/** Whether this browser may change anything. */
export const canOperate = () => role === "operator";

/** Set the role that the server reports; `?view` turns an operator's page into a viewer's. */
export function setRole(said) {
  role = asked ? "viewer" : said;
  document.body.dataset.role = role;
}

setRole("operator");
