// The page to sign in: sends the operator's token, then goes to where the operator wanted to go.
import { t } from "./strings.js";

const form = document.getElementById("sign-in");
const problem = document.getElementById("problem");

function wanted() {
  const next = new URLSearchParams(location.search).get("next") ?? "/";
  const url = new URL(next, location.origin);
  return url.origin === location.origin ? url.pathname : "/";
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  problem.hidden = true;
  try {
    const response = await fetch("api/v1/access/signin", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ token: document.getElementById("token").value }),
    });
    if (response.ok) {
      location.assign(wanted());
      return;
    }
    problem.textContent = (await response.json()).error.message;
  } catch {
    problem.textContent = t("signin.silent");
  }
  problem.hidden = false;
});
