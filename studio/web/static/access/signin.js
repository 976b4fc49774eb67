// The sign-in page: sends the operator's token, then opens the page that the operator wanted.
import { hear, said } from "../base/said.js";
import { t } from "../base/strings.js";

const form = document.getElementById("sign-in");
const problem = document.getElementById("problem");

const asked = new URLSearchParams(location.search);
document.getElementById("again").hidden = !asked.has("again");

function wanted() {
  const next = asked.get("next") ?? "/";
  const url = new URL(next, location.origin);
  return url.origin === location.origin ? url.pathname : "/";
}

async function signIn(token) {
  problem.hidden = true;
  try {
    const response = await fetch("api/v1/access/signin", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ token }),
    });
    if (response.ok) {
      location.assign(wanted());
      return;
    }
    problem.textContent = said(hear((await response.json()).error).message);
  } catch {
    problem.textContent = t("signin.silent");
  }
  problem.hidden = false;
}

form.addEventListener("submit", (event) => {
  event.preventDefault();
  signIn(document.getElementById("token").value);
});
form.querySelector("button").disabled = false; // until now the browser would have sent the form by itself

const given = location.hash.slice(1); // a viewer's link
if (given) {
  history.replaceState(null, "", location.pathname + location.search);
  signIn(given);
}
