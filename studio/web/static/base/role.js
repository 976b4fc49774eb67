// Who looks at this page: the operator, or a viewer, who sees all and changes nothing.
const asked = new URLSearchParams(location.search).has("view");

let role = "operator";

/** Whether this browser may change anything. */
export const canOperate = () => role === "operator";

/** Take in what the server says of who asks; `?view` makes a viewer's page of an operator's. */
export function setRole(said) {
  role = asked ? "viewer" : said;
  document.body.dataset.role = role;
}

setRole("operator");
