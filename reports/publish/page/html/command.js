// A command line to copy.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  rayproof.command = function (text) {
    const button = e("button", { class: "quiet", onclick: () => copy(text, button) }, "copy");
    return e("div", { class: "command" }, e("code", {}, text), button);
  };

  async function copy(text, button) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Not allowed, or no clipboard on this page: the old way.
      const area = e("textarea", { class: "offscreen", value: text });
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    rayproof.replace(button, "copied");
    setTimeout(() => rayproof.replace(button, "copy"), 1500);
  }
})(window.rayproof);
