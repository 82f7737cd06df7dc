// The login page. The form works without this file; with it, an invalid key is reported at the field.
import { link, logIn } from "../api/operations.js";

const form = document.querySelector("form");
const fault = document.getElementById("fault");

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  fault.textContent = "";
  form.key.removeAttribute("aria-invalid");
  try {
    await logIn(form.key.value.trim());
    // Back to the place that a session which has ended showed.
    history.replaceState(null, "", link("/") + location.hash);
    location.reload();
  } catch (error) {
    fault.textContent = error.message;
    form.key.setAttribute("aria-invalid", "true");
    form.key.select();
  }
});
