// What is shown lives in the address after #, so that it can be linked, reloaded and gone back from.
(function (rayproof) {
  "use strict";
  rayproof.address = () => Object.fromEntries(new URLSearchParams(location.hash.slice(1)));

  rayproof.link = function (parts) {
    const kept = Object.entries(parts).filter(([, value]) => value !== "" && value !== null && value !== undefined);
    return `#${new URLSearchParams(kept)}`;
  };

  // Change parts without a new step in the history: for filters, tabs and sliders.
  rayproof.amend = function (parts) {
    location.replace(rayproof.link({ ...rayproof.address(), ...parts }));
    // The change is already on the screen; start.js passes over this address.
    rayproof.quiet = location.hash;
  };

  // How a case is looked at, kept in the address beside which case: a link shows the same to somebody else.
  const DEFAULTS = { mode: "side", metric: "absolute", channel: "-1", exposure: "0", gamma: "0", map: "", colors: "viridis",
    scale: "log", low: "", high: "", explained: "", at: "", zoom: "1" };
  rayproof.modes = ["side", "swipe", "flicker", "onion", "error"];

  const oneOf = (value, known, otherwise) => (known.includes(value) ? value : otherwise);
  const within = (text, low, high, otherwise) => {
    const value = Number(text);
    return text !== "" && Number.isFinite(value) ? Math.min(high, Math.max(low, value)) : otherwise;
  };
  const positive = (text) => (Number(text) > 0 && Number.isFinite(Number(text)) ? Number(text) : null);

  // -> plain values, whatever the address says
  rayproof.settings = function () {
    const told = { ...DEFAULTS, ...rayproof.address() };
    const at = /^(\d{1,6}),(\d{1,6})$/.exec(told.at);
    return {
      mode: oneOf(told.mode, rayproof.modes, "side"),
      metric: oneOf(told.metric, rayproof.metrics, "absolute"),
      channel: Math.round(within(told.channel, -1, 999, -1)),
      exposure: within(told.exposure, -20, 20, 0),
      gamma: within(told.gamma, 0, 5, 0),
      map: oneOf(told.map, rayproof.colorMaps, ""),
      colors: oneOf(told.colors, rayproof.colorMaps, "viridis"),
      log: told.scale !== "linear",
      low: positive(told.low),
      high: positive(told.high),
      explained: told.explained === "1",
      pixel: at ? [Number(at[1]), Number(at[2])] : null,
      zoom: within(told.zoom, 1, 1000, 1),
    };
  };

  // Write what differs from the defaults; the address stays short.
  rayproof.remember = function (parts) {
    rayproof.amend(Object.fromEntries(Object.entries(parts).map(([key, value]) =>
      [key, String(value) === DEFAULTS[key] ? "" : value])));
  };

  // The keyboard: one table that both acts and explains itself under "?".
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
