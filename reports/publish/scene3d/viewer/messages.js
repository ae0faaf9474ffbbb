// Words with the page that holds this frame: only with it, only with the token that it gave us, only words we know.
(function (viewer) {
  "use strict";

  // On disk every file is an origin of its own, called "null", so the window and the token are what there is to check.
  const token = window.name;

  viewer.say = (kind, content) => window.parent.postMessage({ token, kind, ...content }, "*");

  // handlers: {kind: (content) => ...}
  viewer.listen = function (handlers) {
    window.addEventListener("message", (event) => {
      const said = event.data;
      if (event.source !== window.parent || said === null || typeof said !== "object" || said.token !== token) return;
      if (Object.hasOwn(handlers, said.kind)) handlers[said.kind](said);
    });
  };

  const finite = (value) => typeof value === "number" && Number.isFinite(value);
  // A list of `length` finite numbers, or null.
  viewer.vector = (value, length = 3) => (Array.isArray(value) && value.length === length && value.every(finite) ? value : null);
})(window.viewer);
