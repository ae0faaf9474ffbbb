// The keyboard: one table that both acts and explains itself under "?".
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  let table = [];

  // [[keys, words, action]]; `keys` is one key or a list, and a row without an action only explains.
  rayproof.keys = (rows) => { table = rows; };

  const typing = (node) => node instanceof HTMLElement && (node.isContentEditable || node.tagName === "SELECT" || node.tagName === "TEXTAREA"
    || (node.tagName === "INPUT" && node.type !== "checkbox" && node.type !== "range"));

  const shown = { ArrowLeft: "\u2190", ArrowRight: "\u2192", ArrowUp: "\u2191", ArrowDown: "\u2193", " ": "space", Escape: "Esc" };

  function help() {
    const old = document.querySelector("dialog.help");
    if (old) { old.close(); return; }
    const dialog = e("dialog", { class: "help", "aria-labelledby": "help-title" },
      e("h2", { id: "help-title" }, "Keyboard"),
      e("dl", { class: "facts" }, [...table, ["?", "this list"]].map(([keys, words]) =>
        [e("dt", {}, [keys].flat().map((key) => e("kbd", {}, shown[key] || key))), e("dd", {}, words)])),
      e("p", {}, e("button", { class: "quiet", onclick: () => dialog.close() }, "close")));
    dialog.addEventListener("close", () => dialog.remove());
    document.body.append(dialog);
    dialog.showModal();
  }
  rayproof.help = help;

  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
    const open = document.querySelector("dialog[open]");
    if (event.key === "?" && !typing(event.target)) { event.preventDefault(); help(); return; }
    if (open) return;
    if (typing(event.target) && event.key !== "Escape") return;
    // A button's own key stays the button's.
    if (event.key === " " && event.target instanceof HTMLElement && event.target.closest("button, summary, a, input")) return;
    const row = table.find(([keys, , action]) => action && [keys].flat().includes(event.key));
    if (!row) return;
    event.preventDefault();
    row[2](event.key);
  });
})(window.rayproof);
