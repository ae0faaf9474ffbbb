// A small plot of one number over runs: a logarithmic axis, a shape for each verdict, steps and the limit marked.
(function (rayproof) {
  "use strict";
  const { svg } = rayproof;
  const SIZE = { width: 420, height: 116, left: 46, right: 14, top: 16, bottom: 20 };
  const NARROWEST = Math.log10(2); // decades that the axis shows at least

  // Shapes tell verdicts apart without colours: all is well, look here, wrong.
  const SHAPES = { pass: (x, y) => ["circle", { cx: x, cy: y, r: 3 }], warn: (x, y) => ["path", { d: `M${x} ${y - 5}l5 8h-10z` }] };
  const wrong = (x, y) => ["path", { d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8` }];

  function span(values) {
    const logs = values.map(Math.log10);
    const low = Math.min(...logs), high = Math.max(...logs);
    const room = Math.max(0.08 * (high - low), (NARROWEST - (high - low)) / 2, 0.04);
    return [low - room, high + room];
  }

  // points: [{run, revision, verdict, value}], value null where nothing was measured; steps: [[run, factor]].
  rayproof.seriesPlot = function (label, { points, steps, unit, limit, href }) {
    const known = points.filter((point) => point.value > 0 && Number.isFinite(point.value));
    const { width, height, left, right, top, bottom } = SIZE;
    const shown = { viewBox: `0 0 ${width} ${height}`, class: "series", role: known.length ? "group" : "img", "aria-label": label };
    if (!known.length) return svg("svg", shown, svg("text", { x: width / 2, y: height / 2, "text-anchor": "middle" }, "nothing above zero was measured"));
    const values = known.map((point) => point.value);
    // The limit is shown where it is near: far away it would leave no room for the steps.
    const near = limit && Math.max(...values) > limit / 30;
    const [low, high] = span(near ? [...values, limit] : values);
    const xs = points.map((_, i) => (points.length > 1 ? left + (i * (width - left - right)) / (points.length - 1) : (left + width - right) / 2));
    const y = (value) => height - bottom - ((Math.log10(value) - low) / (high - low)) * (height - top - bottom);
    // Infinity and NaN stand above the rest, zero below.
    const place = (value) => (value > 0 && Number.isFinite(value) ? y(value) : value === 0 ? height - bottom : top - 6);
    const at = (run) => xs[points.findIndex((point) => point.run === run)];
    const line = points.map((point, i) => (point.value === null ? "" : `${i && points[i - 1].value !== null ? "L" : "M"}${xs[i]} ${place(point.value)}`)).join("");
    const words = (text, x, where, anchor) => svg("text", { x, y: where, "text-anchor": anchor }, text);
    return svg("svg", shown,
      svg("path", { class: "frame", d: `M${left} ${top}V${height - bottom}H${width - right}` }),
      words(rayproof.short(Math.max(...values), 2), left - 5, y(Math.max(...values)) + 4, "end"),
      Math.max(...values) > 1.3 * Math.min(...values) ? words(rayproof.short(Math.min(...values), 2), left - 5, y(Math.min(...values)) + 4, "end") : null,
      words(`run ${points[0].run}`, left, height - 5, "start"),
      points.length > 1 ? words(`run ${points.at(-1).run}`, width - right, height - 5, "end") : null,
      // At the left, where no step can be whose factor it would cover.
      near ? [svg("path", { class: "limit", d: `M${left} ${y(limit)}H${width - right}` }), words("limit", left + 6, y(limit) - 3, "start")] : null,
      svg("path", { class: "line", d: line }),
      steps.filter(([run]) => at(run) !== undefined).map(([run, factor]) => {
        const up = rayproof.number(factor) > 1;
        return svg("g", { class: `step ${up ? "up" : "down"}` }, svg("path", { d: `M${at(run)} ${top}V${height - bottom}` }),
          words(`${up ? "\u25B2" : "\u25BC"} \u00D7${rayproof.short(factor, 2)}`, at(run), top - 5, at(run) > width - 80 ? "end" : at(run) < left + 40 ? "start" : "middle"));
      }),
      points.map((point, i) => {
        if (point.value === null) return null;
        const [tag, shape] = (SHAPES[point.verdict] || wrong)(xs[i], place(point.value));
        const name = `run ${point.run}${point.revision ? ` (${point.revision})` : ""}: ${rayproof.short(point.value)}${unit}, ${rayproof.word(point.verdict)}`;
        return svg("a", { href, tabindex: i === points.length - 1 ? 0 : -1, "aria-label": name, class: `dot ${SHAPES[point.verdict] ? point.verdict : "wrong"}` },
          svg("title", {}, name), svg(tag, shape));
      }));
  };
})(window.rayproof);
