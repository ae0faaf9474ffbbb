// Plots by Plotly: the library is loaded with the first plot, each plot drawn when it comes near the screen.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const LIBRARY = "plots/plotly-basic.min.js";
  // Hues that stay apart without colour vision, and a shape beside each.
  const COLORS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8c6bb1", "#a6761d", "#7f8c8d", "#b2475d"];
  const SYMBOLS = ["circle", "square", "diamond", "triangle-up", "triangle-down", "pentagon", "star", "hexagon", "cross", "x"];
  let loading = null;

  rayproof.hue = (index) => COLORS[index % COLORS.length];
  rayproof.symbol = (index, open) => SYMBOLS[index % SYMBOLS.length] + (open ? "-open" : "");

  // Plotly reads markup, links and templates in its texts; names of others are to stay text.
  rayproof.plotText = (text) => String(text).replaceAll("<", "\u2039").replaceAll("%{", "% {").replaceAll("$", "\uFF04");

  function library() {
    loading = loading || (rayproof.inlined(LIBRARY) ? rayproof.unfolded(LIBRARY).then(run) : new Promise((resolve, reject) => {
      const script = document.createElement("script");
      script.onload = () => resolve(window.Plotly);
      script.onerror = () => { loading = null; reject(new Error(`${LIBRARY} is missing beside index.html`)); };
      script.src = rayproof.place(LIBRARY);
      document.head.append(script);
    }));
    return loading;
  }

  // The policy of a report that is a single file lets this text in by its hash.
  function run(text) {
    const script = document.createElement("script");
    script.textContent = text;
    document.head.append(script);
    return window.Plotly;
  }

  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  function themed(layout) {
    const line = color("--line"), text = color("--text");
    // Powers would be superscripts, which Plotly styles in a way that a strict policy refuses.
    const axis = { gridcolor: line, linecolor: line, zerolinecolor: line, exponentformat: "e", automargin: true };
    return { margin: { l: 64, r: 12, t: 12, b: 48 }, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)",
      font: { color: text, size: 12, family: "system-ui, sans-serif" }, hovermode: "closest",
      modebar: { bgcolor: "rgba(0,0,0,0)", color: color("--muted"), activecolor: color("--text") },
      hoverlabel: { bgcolor: color("--panel"), bordercolor: line, font: { color: text } },
      legend: { font: { size: 11 }, itemsizing: "constant" }, ...layout,
      xaxis: { ...axis, ...layout.xaxis }, yaxis: { ...axis, ...layout.yaxis } };
  }

  // Below this width [CSS px] a legend beside a plot would leave nothing of the plot.
  const NARROW = 560;
  // Named one by one: the usual buttons hold one that sends the data to a company's server.
  const OPTIONS = { displaylogo: false, plotlyServerURL: "", modeBarButtons: [["zoom2d", "pan2d", "zoomIn2d", "zoomOut2d", "resetScale2d"]] };

  async function draw(node, { traces, layout, onpoint, instead }) {
    try {
      const plotly = await library();
      if (!node.isConnected) return;
      const narrow = node.clientWidth < NARROW;
      const legend = narrow ? { orientation: "h", y: -0.25 } : {};
      await plotly.newPlot(node, traces, themed({ ...layout, legend: { font: { size: 11 }, ...legend } }), { ...OPTIONS, displayModeBar: narrow ? false : "hover" });
      node.on("plotly_click", ({ points }) => { if (points[0]?.customdata !== undefined) onpoint(points[0].customdata); });
      new ResizeObserver(() => { if (node.isConnected && node.clientWidth) plotly.Plots.resize(node); }).observe(node);
      node.dataset.drawn = "yes";
    } catch (error) {
      rayproof.replace(node, e("p", { class: "muted" }, error.message), instead());
    }
  }

  // -> a node that holds what a promise brings, or why it did not
  rayproof.later = function (promise) {
    const node = e("div", { class: "later" }, e("p", { class: "muted" }, "loading \u2026"));
    promise.then((content) => rayproof.replace(node, content), (error) => rayproof.replace(node, e("p", { class: "shout", role: "alert" }, error.message)));
    return node;
  };

  // -> a node that draws itself when it is seen. make() -> {traces, layout, onpoint(customdata), instead() -> node}
  rayproof.plot = function (label, make) {
    const node = e("div", { class: "plot", role: "group", "aria-label": label });
    const seen = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      seen.disconnect();
      draw(node, make());
    }, { rootMargin: "200px" });
    seen.observe(node);
    return node;
  };

  // One ladder as a plot: median error (or share of wrong answers) up the sweep, predicted slopes, the gate.
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

  // A small plot of one number over runs: a logarithmic axis, a shape for each verdict, the limit marked.
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

  // points: [{run, revision, verdict, value}], value null where nothing was measured.
  rayproof.seriesPlot = function (label, { points, unit, limit, href }) {
    const known = points.filter((point) => point.value > 0 && Number.isFinite(point.value));
    const { width, height, left, right, top, bottom } = SIZE;
    const shown = { viewBox: `0 0 ${width} ${height}`, class: "series", role: known.length ? "group" : "img", "aria-label": label };
    if (!known.length) return svg("svg", shown, svg("text", { x: width / 2, y: height / 2, "text-anchor": "middle" }, "nothing above zero was measured"));
    const values = known.map((point) => point.value);
    // The limit is shown where it is near: far away it would leave no room for the points.
    const near = limit && Math.max(...values) > limit / 30;
    const [low, high] = span(near ? [...values, limit] : values);
    const xs = points.map((_, i) => (points.length > 1 ? left + (i * (width - left - right)) / (points.length - 1) : (left + width - right) / 2));
    const y = (value) => height - bottom - ((Math.log10(value) - low) / (high - low)) * (height - top - bottom);
    // Infinity and NaN stand above the rest, zero below.
    const place = (value) => (value > 0 && Number.isFinite(value) ? y(value) : value === 0 ? height - bottom : top - 6);
    const line = points.map((point, i) => (point.value === null ? "" : `${i && points[i - 1].value !== null ? "L" : "M"}${xs[i]} ${place(point.value)}`)).join("");
    const words = (text, x, where, anchor) => svg("text", { x, y: where, "text-anchor": anchor }, text);
    return svg("svg", shown,
      svg("path", { class: "frame", d: `M${left} ${top}V${height - bottom}H${width - right}` }),
      words(rayproof.short(Math.max(...values), 2), left - 5, y(Math.max(...values)) + 4, "end"),
      Math.max(...values) > 1.3 * Math.min(...values) ? words(rayproof.short(Math.min(...values), 2), left - 5, y(Math.min(...values)) + 4, "end") : null,
      words(`run ${points[0].run}`, left, height - 5, "start"),
      points.length > 1 ? words(`run ${points.at(-1).run}`, width - right, height - 5, "end") : null,
      near ? [svg("path", { class: "limit", d: `M${left} ${y(limit)}H${width - right}` }), words("limit", left + 6, y(limit) - 3, "start")] : null,
      svg("path", { class: "line", d: line }),
      points.map((point, i) => {
        if (point.value === null) return null;
        const [tag, shape] = (SHAPES[point.verdict] || wrong)(xs[i], place(point.value));
        const name = `run ${point.run}${point.revision ? ` (${point.revision})` : ""}: ${rayproof.short(point.value)}${unit}, ${rayproof.word(point.verdict)}`;
        return svg("a", { href, tabindex: i === points.length - 1 ? 0 : -1, "aria-label": name, class: `dot ${SHAPES[point.verdict] ? point.verdict : "wrong"}` },
          svg("title", {}, name), svg(tag, shape));
      }));
  };

  // A value and its interval on an axis that all rows of a table share.
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
