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
})(window.rayproof);
