// How a case is looked at, kept in the address beside which case: a link shows the same to somebody else.
(function (rayproof) {
  "use strict";

  const DEFAULTS = { mode: "side", metric: "absolute", channel: "-1", exposure: "0", gamma: "0", map: "", colors: "viridis",
    scale: "log", low: "", high: "", edges: "", at: "", zoom: "1" };
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
      edges: told.edges === "1",
      pixel: at ? [Number(at[1]), Number(at[2])] : null,
      zoom: within(told.zoom, 1, 1000, 1),
    };
  };

  // Write what differs from the defaults; the address stays short.
  rayproof.remember = function (parts) {
    rayproof.amend(Object.fromEntries(Object.entries(parts).map(([key, value]) =>
      [key, String(value) === DEFAULTS[key] ? "" : value])));
  };
})(window.rayproof);
