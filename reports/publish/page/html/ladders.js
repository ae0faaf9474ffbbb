// One ladder as a plot: median error (or share of wrong answers) up the sweep, predicted slopes, the gate.
(function (rayproof) {
  "use strict";
  const LEAST_SHARE = 1e-6; // where a share of zero is drawn

  const numbers = (values) => values.map((value) => rayproof.number(value));
  const numeric = (value) => typeof value === "number" && Number.isFinite(value);

  rayproof.measures = (ladder) => (ladder.kind ? ladder.kind === "sweep" : true)
    && ladder.climbs.some((climb) => climb.values.median.some((value) => value > 0));

  // A sweep that is not of positive numbers in order has its values as words.
  function axisOf(ladder) {
    const steps = ladder.values.slice(1).map((value, i) => value - ladder.values[i]);
    const down = steps.every((step) => step < 0);
    const logarithmic = ladder.values.every((value) => value > 0) && (down || steps.every((step) => step > 0));
    return logarithmic ? { type: "log", autorange: down ? "reversed" : true } : { type: "category" };
  }

  const place = (axis, value) => (axis.type === "log" ? value : String(value));

  function measured(ladder, climb, axis, index) {
    const { value, rays, wrong, median, median_low: low, median_high: high } = climb.values;
    const errors = rayproof.measures(ladder);
    const y = errors ? numbers(median).map((one) => (one > 0 ? one : null))
      : wrong.map((count, i) => (rays[i] ? Math.max(count / rays[i], LEAST_SHARE) : null));
    // An interval that reaches down to exact is drawn a decade long: zero has no place on a logarithmic axis.
    const arms = errors && low.some(numeric) ? { error_y: { type: "data", symmetric: false, thickness: 1, width: 2,
      array: y.map((one, i) => (numeric(one) && numeric(high[i]) ? high[i] - one : 0)),
      arrayminus: y.map((one, i) => (numeric(one) && numeric(low[i]) ? Math.min(one - low[i], 0.9 * one) : 0)) } } : {};
    const bad = climb.expected === "fail";
    return { x: value.map((one) => place(axis, one)), y, ...arms, type: "scatter", mode: "lines+markers", legendgroup: climb.formula,
      name: rayproof.plotText(rayproof.variant(climb.formula)) + (bad ? " \u2020" : ""), customdata: value.map((_, i) => ({ climb, i })),
      line: { color: rayproof.hue(index), width: 1.5, dash: bad ? "dash" : "solid" },
      marker: { color: rayproof.hue(index), symbol: rayproof.symbol(index), size: 6 },
      hovertemplate: `${rayproof.plotText(climb.formula)}<br>%{x}: %{y:.3g}<extra></extra>` };
  }

  // The law's line through the middle of what was measured, where errors are not yet as large as they can be.
  function predicted(ladder, climb, axis, index) {
    if (!numeric(climb.slope_predicted) || axis.type !== "log" || !rayproof.measures(ladder)) return null;
    const law = (ladder.laws || []).find((one) => one.slope === climb.slope_predicted && one.precisions.includes(climb.precision));
    const from = Math.max(0, climb.values.value.indexOf(law?.first));
    const points = climb.values.value.map((x, i) => [x, climb.values.median[i]]).slice(from)
      .filter(([, y]) => y > 0 && y <= (ladder.saturated ?? Infinity));
    if (points.length < 2) return null;
    const offsets = points.map(([x, y]) => Math.log10(y) - climb.slope_predicted * Math.log10(x)).sort((a, b) => a - b);
    const offset = offsets[Math.floor(offsets.length / 2)];
    const xs = [points[0][0], points.at(-1)[0]];
    return { x: xs, y: xs.map((x) => 10 ** (offset + climb.slope_predicted * Math.log10(x))), mode: "lines", type: "scatter",
      legendgroup: climb.formula, showlegend: false, hoverinfo: "skip", line: { color: rayproof.hue(index), width: 1, dash: "dot" } };
  }

  rayproof.ladderPlot = function (ladder, precision, formulas, onpoint, instead) {
    const axis = axisOf(ladder);
    const climbs = ladder.climbs.filter((climb) => climb.precision === precision);
    const index = (climb) => formulas.indexOf(climb.formula);
    const gate = ladder.gate?.reaches?.[precision];
    const drawable = axis.type === "log" && gate > 0;
    const traces = [...climbs.map((climb) => predicted(ladder, climb, axis, index(climb))).filter(Boolean),
      ...climbs.map((climb) => measured(ladder, climb, axis, index(climb)))];
    return { traces, onpoint, instead, layout: {
      xaxis: { ...axis, title: { text: rayproof.plotText(ladder.parameter) } },
      yaxis: { type: "log", title: { text: rayproof.measures(ladder) ? `median error [${rayproof.plotText(ladder.unit)}]` : "share of wrong answers" } },
      shapes: drawable ? [{ type: "line", x0: gate, x1: gate, yref: "paper", y0: 0, y1: 1, line: { dash: "dash", width: 1, color: "#8a949e" } }] : [],
      annotations: drawable ? [{ x: Math.log10(gate), yref: "paper", y: 1, text: "gate", showarrow: false, xanchor: "left", yanchor: "top", font: { color: "#8a949e" } }] : [] } };
  };

  rayproof.variant = (formula) => formula.slice(formula.indexOf("/") + 1);
})(window.rayproof);
