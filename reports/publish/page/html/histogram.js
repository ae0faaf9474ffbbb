// How often which error occurs, on the scale of the colour bar; the limit is a line, what lies beyond it hatched.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  // -> {bins: [count], zero, below, above, odd: NaN and infinities}
  rayproof.histogram = function (errors, range, log, count = 48) {
    const bins = new Array(count).fill(0);
    let zero = 0, below = 0, above = 0, odd = 0;
    for (const value of errors.values) {
      if (!Number.isFinite(value)) odd += 1;
      else if (value === 0 && log) zero += 1;
      else {
        const place = rayproof.position(value, range, log);
        if (place < 0) below += 1;
        else if (place > 1) above += 1;
        else bins[Math.min(count - 1, Math.floor(place * count))] += 1;
      }
    }
    return { bins, zero, below, above, odd };
  };

  const WIDTH = 480, HEIGHT = 90;
  const { svg } = rayproof;

  // `limit` is null where the limit is of another quantity than the metric shown.
  rayproof.histogramView = function (errors, range, log, limit) {
    const { bins, zero, below, above, odd } = rayproof.histogram(errors, range, log);
    const top = Math.log1p(Math.max(1, ...bins));
    const wide = WIDTH / bins.length;
    const at = limit === null ? null : rayproof.position(limit, range, log);
    const shown = at !== null && at >= 0 && at <= 1;
    const bars = bins.map((number, i) => {
      const high = (Math.log1p(number) / top) * HEIGHT;
      const over = at !== null && i / bins.length >= at;
      return number ? svg("rect", { x: i * wide + 0.5, y: HEIGHT - high, width: wide - 1, height: high, class: over ? "bin over" : "bin" }) : null;
    });
    const said = [zero && `${zero} without error`, below && `${below} below the range`, above && `${above} above it`,
      odd && `${odd} NaN or infinite`].filter(Boolean).join(", ");
    const beyond = limit === null ? null : errors.values.reduce((sum, value) => sum + !(Math.abs(value) <= limit), 0);
    const words = beyond === null ? "" : beyond ? `${beyond} pixels beyond the limit at its worst pixel, ${rayproof.short(limit)}`
      : `no pixel beyond the limit at its worst pixel, ${rayproof.short(limit)}`;
    return e("figure", { class: "histogram" },
      svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img",
        "aria-label": `Histogram of ${errors.metric} errors; ${words || "no limit of this quantity"}` },
      bars, shown ? svg("line", { x1: at * WIDTH, x2: at * WIDTH, y1: 0, y2: HEIGHT, class: "limit" }) : null),
      e("figcaption", { class: "muted" }, [`${errors.values.length} pixels, counts on a log scale`, said, words].filter(Boolean).join(" \u00B7 ")));
  };
})(window.rayproof);
