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
})(window.rayproof);
