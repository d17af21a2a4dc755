// Light or dark theme: the system setting, until the reader chooses. Print is always light.

const root = document.documentElement;
const systemIsDark = matchMedia("(prefers-color-scheme: dark)");
let chosenDark = null;
let printing = false;
const themeListeners = [];

const isDark = () => !printing && (chosenDark ?? systemIsDark.matches);

/** Return the value of a colour of the page. */
const tone = (name) => getComputedStyle(root).getPropertyValue(`--${name}`).trim();

function applyTheme() {
  root.classList.toggle("dark", isDark());
  root.style.colorScheme = isDark() ? "dark" : "light";
  const button = document.querySelector(".theme");
  button.textContent = isDark() ? "Light" : "Dark";
  button.setAttribute("aria-label", `Show the page in ${isDark() ? "light" : "dark"} colours`);
  button.hidden = false;
  for (const listener of themeListeners) listener();
}

function followTheme() {
  document.querySelector(".theme").addEventListener("click", () => {
    chosenDark = !isDark();
    applyTheme();
  });
  systemIsDark.addEventListener("change", applyTheme);
  applyTheme();
}
