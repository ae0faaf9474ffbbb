// Error against run time: work-precision diagrams, with the front of what nothing else beats.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const hueOf = (point) => point.variant || point.renderer;
  const finite = (value) => typeof value === "number" && Number.isFinite(value);

  function traces(diagram) {
    const drawn = diagram.points.filter((point) => finite(point.error) && finite(point.nanoseconds));
    const hues = [...new Set(drawn.map(hueOf))];
    const arm = (list, middle, low, high) => ({ type: "data", symmetric: false, thickness: 1, width: 2,
      array: list.map((point) => Math.max(0, point[high] - point[middle])), arrayminus: list.map((point) => Math.max(0, point[middle] - point[low])) });
    const groups = hues.map((hue, index) => {
      const list = drawn.filter((point) => hueOf(point) === hue);
      return { x: list.map((point) => point.nanoseconds), y: list.map((point) => point.error), mode: "markers", type: "scatter", name: rayproof.plotText(hue),
        error_x: arm(list, "nanoseconds", "nanoseconds_low", "nanoseconds_high"), error_y: arm(list, "error", "error_low", "error_high"),
        customdata: list, text: list.map((point) => rayproof.plotText(point.label) + (point.wrong ? `, ${(100 * point.wrong).toPrecision(2)} % wrong` : "")),
        hovertemplate: "%{text}<br>%{x:.3g} ns, error %{y:.3g}<extra></extra>",
        marker: { color: rayproof.hue(index), size: 9, line: { width: 1.5 },
          symbol: list.map((point) => (point.kind === "control" ? "x" : rayproof.symbol(point.precision === "float64" ? 1 : 0, !point.front))) } };
    });
    const front = diagram.front.map((label) => drawn.find((point) => point.label === label)).filter(Boolean);
    return [{ x: front.map((point) => point.nanoseconds), y: front.map((point) => point.error), mode: "lines", type: "scatter", name: "Pareto front",
      hoverinfo: "skip", line: { dash: "dash", width: 1, color: "#8a949e" } }, ...groups];
  }

  // What measures this point again, and the cases of its family where the run has some.
  function origin(results, diagram, point) {
    const [slot, ...rest] = diagram.name.split("/");
    const family = rest.join("/");
    const command = diagram.kind === "ladders" ? `rayproof stability ${slotless(point)} --ladder ${rayproof.quoted(family)} --precision ${point.precision}`
      : family === "overall" ? "rayproof tradeoff" : `rayproof tradeoff ${rayproof.quoted(family)}`;
    const cases = results.cases.some((row) => row.family === family) ? e("p", {}, e("a", { href: rayproof.link({ family }) }, `cases of ${family}`)) : null;
    const ladder = diagram.kind === "ladders" && results.plots?.stability ? e("p", {}, e("a", { href: rayproof.link({ page: "stability", ladder: family }) }, `ladder ${family}`)) : null;
    return [cases, ladder, rayproof.command(command)];

    function slotless(one) { return one.variant ? rayproof.quoted(`*/${one.variant}`) : ""; }
  }

  function card(results, diagram) {
    const chosen = e("div", { role: "status" });
    const onpoint = (point) => rayproof.replace(chosen, e("p", {}, e("strong", {}, point.label), `: ${rayproof.short(point.nanoseconds)} ns [${rayproof.short(point.nanoseconds_low)}, ${rayproof.short(point.nanoseconds_high)}] by ${point.clock === "wall" ? "the wall's clock" : "kernel times"}, error ${rayproof.short(point.error)} [${rayproof.short(point.error_low)}, ${rayproof.short(point.error_high)}]`,
      finite(point.natural) ? `, ${rayproof.short(point.natural)} ${point.unit}` : "", point.wrong ? `, ${rayproof.short(100 * point.wrong)} % ${diagram.kind === "paths" ? "less exact than declared" : "decided wrongly"}` : ""), origin(results, diagram, point));
    const table = e("details", { ontoggle: () => { if (table.open && table.children.length === 1) table.append(numbers(diagram, onpoint)); } }, e("summary", {}, "numbers"));
    return e("section", { class: "panel ladder", "aria-label": diagram.name }, e("h2", {}, diagram.name, " ", e("span", { class: "muted" }, "faster to the left, more accurate below")),
      rayproof.plot(`${diagram.name}: ${diagram.error_axis} over ${diagram.time_axis}`, () => ({ traces: traces(diagram), onpoint,
        instead: () => e("img", { src: `tradeoff/${encodeURIComponent(diagram.svg)}`, alt: diagram.name, loading: "lazy" }),
        layout: { xaxis: { type: "log", title: { text: rayproof.plotText(diagram.time_axis) } }, yaxis: { type: "log", title: { text: rayproof.plotText(diagram.error_axis) } } } })),
      chosen, table);
  }

  function numbers(diagram, onpoint) {
    const cells = (point) => [rayproof.short(point.nanoseconds), rayproof.short(point.error), point.wrong ? `${rayproof.short(100 * point.wrong)} %` : ""];
    return rayproof.scroll("table of points", e("table", {},
      e("thead", {}, e("tr", {}, ["", diagram.time_axis, diagram.error_axis, "wrong", "front"].map((title) => e("th", { scope: "col" }, title)))),
      e("tbody", {}, [...diagram.points].sort((a, b) => a.nanoseconds - b.nanoseconds).map((point) => e("tr", {},
        e("th", { scope: "row" }, e("button", { class: "link", onclick: () => onpoint(point) }, point.label)),
        cells(point).map((text) => e("td", { class: "figure" }, text)), e("td", {}, point.front ? rayproof.glyph("pass") : ""))))));
  }

  async function view(results) {
    const data = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.tradeoff)));
    const order = [...data.diagrams].sort((a, b) => b.name.endsWith("/overall") - a.name.endsWith("/overall"));
    return [e("section", { class: "panel" }, e("h1", {}, "Error against run time"),
      e("p", { class: "muted" }, `${data.repetitions} interleaved repetitions; intervals of 95 %. Filled: on the front. Circles float32, squares float64, crosses formulas that are kept as wrong.`),
      results.alone ? null : e("p", {}, e("a", { href: "tradeoff/tradeoff.csv" }, "all numbers as CSV"))),
    e("div", { class: "ladders" }, order.map((diagram) => card(results, diagram)))];
  }

  rayproof.addPage("tradeoff", { title: "Error against time", has: (results) => Boolean(results.plots?.tradeoff),
    view: (results) => rayproof.later(view(results)) });
})(window.rayproof);
