// A button beside a member copies the command that runs it.

/** Copy a command where the browser allows it, and show it for some seconds. */
async function copyCommand(button) {
  const { command } = button.dataset;
  let words = "";
  try {
    await navigator.clipboard.writeText(command);
    words = "Copied: ";
  } catch {
    // Some browsers allow it on secure pages only; the text can be selected.
  }
  showBriefly(words, command);
}

for (const button of document.querySelectorAll("button.copy")) {
  button.hidden = false;
  button.addEventListener("click", () => copyCommand(button));
}
