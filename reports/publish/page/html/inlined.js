// In a report that is a single file, what else lies beside the page is in it: elements named by their paths.
(function (rayproof) {
  "use strict";

  // Where a file of the results folder is, for src and href. No segment of a path is markup or a scheme.
  rayproof.place = (path) => `./${path.split("/").map(encodeURIComponent).join("/")}`;

  rayproof.inlined = (path) => document.querySelector(`script[data-path="${CSS.escape(path)}"]`);

  // -> Promise of a text that the page holds deflated
  rayproof.unfolded = (path) => rayproof.inflateText(rayproof.inlined(path).textContent);

  // What an image's src is.
  rayproof.source = function (path) {
    const held = rayproof.inlined(path);
    return held ? `data:${held.dataset.type};base64,${held.textContent}` : rayproof.place(path);
  };
})(window.rayproof);
