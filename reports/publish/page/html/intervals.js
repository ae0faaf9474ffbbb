// A value and its interval on an axis that all rows of a table share.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const { svg } = rayproof;
  const HEIGHT = 18;

  const finite = (pair) => (pair || []).map((one) => rayproof.number(one)).filter((one) => Number.isFinite(one));
  const scaled = (value, log) => (log ? Math.log(value) : value);

  // -> bar(value, pair, words) -> node. `nothing` is where nothing differs: 0, or 1 of a ratio, whose axis is `log`.
  rayproof.intervals = function (pairs, nothing, { log = false, width = 180 } = {}) {
    const ends = pairs.flatMap(finite).map((one) => scaled(one, log)).filter((one) => Number.isFinite(one));
    const none = scaled(nothing, log);
    const [low, high] = [Math.min(none, ...ends), Math.max(none, ...ends)];
    const x = (one) => 4 + ((one - low) / (high - low || 1)) * (width - 8);
    return function (value, pair, words) {
      const [from, to] = finite(pair).map((one) => scaled(one, log)), at = scaled(rayproof.number(value) ?? NaN, log);
      if (![from, to, at].every((one) => Number.isFinite(one))) return e("span", { class: "muted" }, "\u2013");
      return e("span", { class: "interval" }, svg("svg", { viewBox: `0 0 ${width} ${HEIGHT}`, width, height: HEIGHT, "aria-hidden": "true" },
        svg("path", { class: "nothing", d: `M${x(none)} 0V${HEIGHT}` }), svg("path", { class: "reach", d: `M${x(from)} ${HEIGHT / 2}H${x(to)}` }),
        svg("circle", { cx: x(at), cy: HEIGHT / 2, r: 3.5 })), words);
    };
  };

  // "[low, high]" with so many places
  rayproof.between = (pair, places) => `[${finite(pair).map((value) => value.toFixed(places)).join(", ")}]`;
})(window.rayproof);
