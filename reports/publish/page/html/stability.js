// Where formulas stop being right: breakpoints as a table, and every ladder with its slopes.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const slotOf = (formula) => formula.slice(0, formula.indexOf("/"));
  const distinct = (values) => [...new Set(values)];
  const th = (title) => e("th", { scope: "col" }, title);

  const NEVER = "never right"; // not even at the ladder's first value

  // As expected, known to fail, or a surprise: a shape and a word for each.
  function state(climb) {
    if (climb.surprise) return ["fail", "surprise"];
    return climb.verdict === "pass" ? ["pass", "pass"] : ["unsupported", "known to fail"];
  }
  function mark(climb) {
    const [name, word] = state(climb);
    return e("span", { class: `glyph mark ${rayproof.tone(name)}`, title: climb.surprise || climb.known || word }, rayproof.glyph(name));
  }

  const command = (ladder, climb) => `rayproof stability ${rayproof.quoted(climb.formula)} ${rayproof.quoted(ladder.ladder)} --precision ${climb.precision}`;

  function breakpoints(ladders, formulas, precision) {
    const cell = (ladder, formula) => {
      const climb = ladder.climbs.find((one) => one.formula === formula && one.precision === precision);
      if (!climb) return e("td");
      const value = climb.breakpoint === null ? NEVER : rayproof.short(climb.breakpoint, 2);
      return e("td", { class: "figure" }, mark(climb), " ", value);
    };
    return e("section", { class: "panel", "aria-label": "Breakpoints" },
      e("h2", {}, "Breakpoints ", e("span", { class: "muted" }, "the last value up to which at most 0.1 % of the rays are answered wrongly and no error exceeds the gate")),
      rayproof.scroll("table of breakpoints", e("table", { class: "breakpoints" },
        e("thead", {}, e("tr", {}, th("formula"), ladders.map((ladder) => e("th", { scope: "col" },
          e("a", { href: rayproof.link({ ...rayproof.address(), ladder: ladder.ladder }), onclick: (event) => jump(event, ladder.ladder) }, ladder.ladder))))),
        e("tbody", {}, formulas.map((formula) => e("tr", {}, e("th", { scope: "row" }, formula), ladders.map((ladder) => cell(ladder, formula))))))),
      e("p", { class: "muted legend" }, rayproof.glyph("pass"), " as far as it must  ", rayproof.glyph("unsupported"), " known to fail  ", rayproof.glyph("fail"), " surprise"));
  }

  function jump(event, name) {
    event.preventDefault();
    rayproof.amend({ ladder: name });
    document.getElementById(`ladder-${name}`)?.scrollIntoView();
  }

  function slopes(ladder, climbs) {
    const interval = (climb) => (climb.slope_interval ? ` [${climb.slope_interval.map((value) => rayproof.short(value)).join(", ")}]` : "");
    return rayproof.scroll("table of slopes", e("table", {},
      e("thead", {}, e("tr", {}, ["formula", "", "slope, 95 % interval", "predicted", "breakpoint", "worst error / K u", "per million", "why"].map(th))),
      e("tbody", {}, climbs.map((climb) => e("tr", {}, e("th", { scope: "row" }, climb.formula), e("td", {}, mark(climb)),
        e("td", { class: "figure" }, rayproof.short(climb.slope), e("span", { class: "muted" }, interval(climb))),
        e("td", { class: "figure" }, rayproof.short(climb.slope_predicted)), e("td", { class: "figure" }, rayproof.short(climb.breakpoint) || NEVER),
        e("td", { class: "figure" }, rayproof.short(climb.worst_error_over_Ku)),
        e("td", {}, Object.entries(climb.per_million || {}).map(([name, count]) => `${name.replaceAll("_", " ")} ${rayproof.short(count)}`).join(", ")),
        e("td", {}, rayproof.prose(climb.surprise || climb.known || (climb.reasons || []).join("; "))))))));
  }

  function ladderCard(ladder, precision, formulas) {
    const climbs = ladder.climbs.filter((climb) => climb.precision === precision && formulas.includes(climb.formula));
    const shown = { ...ladder, climbs };
    const chosen = e("div", { role: "status" });
    const picture = () => e("img", { src: `stability/${encodeURIComponent(ladder.ladder)}.svg`, alt: `ladder ${ladder.ladder}`, loading: "lazy" });
    const onpoint = ({ climb, i }) => {
      const at = climb.values;
      rayproof.replace(chosen, e("p", {}, e("strong", {}, climb.formula), ` at ${rayproof.short(at.value[i])}: median error ${rayproof.short(at.median[i]) || "none"}`,
        at.median_low?.[i] == null ? "" : ` [${rayproof.short(at.median_low[i])}, ${rayproof.short(at.median_high[i])}]`,
        `, 99 % ${rayproof.short(at.p99[i]) || "none"}, worst ${rayproof.short(at.worst_over_Ku[i]) || "none"} K u, ${at.wrong[i]} of ${at.rays[i]} rays wrong`),
      rayproof.command(command(ladder, climb)));
    };
    const table = e("details", { ontoggle: () => { if (table.open && table.children.length === 1) table.append(slopes(ladder, climbs)); } },
      e("summary", {}, "slopes and breakpoints"));
    const laws = (ladder.laws || []).filter((law) => law.precisions.includes(precision));
    return e("section", { class: "panel ladder", id: `ladder-${ladder.ladder}`, "aria-label": ladder.ladder },
      e("h3", {}, ladder.ladder, " ", e("span", { class: "muted" }, ladder.parameter)),
      rayproof.plot(`${ladder.ladder}: error against ${ladder.parameter}, ${precision}`, () => rayproof.ladderPlot(shown, precision, formulas, onpoint, picture)),
      chosen,
      e("p", { class: "muted" }, "\u2020 known to fail, dashed; dotted: predicted slope; bars: 95 % interval of the median. K = ", ladder.condition, ladder.survivor ? `. Survives: ${ladder.survivor}` : "", ladder.first_to_break ? `. First to break: ${ladder.first_to_break}.` : ""),
      ladder.measured ? e("p", {}, ladder.measured) : null,
      laws.map((law) => e("p", { class: "muted" }, `Predicted slope ${law.slope} of ${law.formulas.map((name) => (name === "*" ? "all others" : name)).join(", ")}: ${law.because}`)),
      table, rayproof.command(`rayproof stability ${rayproof.quoted(ladder.ladder)} --precision ${precision}`));
  }

  function headline({ ladders, about }) {
    const climbs = ladders.flatMap((ladder) => ladder.climbs);
    const surprises = climbs.filter((climb) => climb.surprise).length + (about.doubts || []).length;
    const tone = surprises ? "fail" : "pass";
    const several = (count, what) => `${count} ${what}${count === 1 ? "" : "s"}`;
    return e("section", { class: `verdict ${rayproof.tone(tone)}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(tone)),
      e("div", {}, e("h1", {}, [several(ladders.length, "ladder"), several(climbs.length, "climb"), several(climbs.filter((climb) => climb.expected === "fail").length, "known failure"), several(surprises, "surprise")].join(", ")),
        e("p", { class: "muted" }, [about.quick ? "few rays (--quick)" : null, about.environment?.backend, Object.entries(about.subnormals || {}).map(([name, word]) => `${name} subnormals ${word}`).join(", ")].filter(Boolean).join(" \u00B7 "))));
  }

  // What the page says where nothing was measured: which commands do.
  const unmeasured = (what, command) => e("section", { class: "panel" }, e("p", {}, `Not measured in this run: ${what}. This command adds them to the folder of this report and publishes it again:`),
    rayproof.command(`rayproof ${command} --quick --out FOLDER && rayproof report FOLDER`));

  async function stabilityView(results) {
    const data = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.stability)));
    const climbs = data.ladders.flatMap((ladder) => ladder.climbs);
    const slots = distinct(climbs.map((climb) => slotOf(climb.formula)));
    const precisions = distinct(climbs.map((climb) => climb.precision));
    const body = e("div"), controls = e("div", { class: "controls" });
    const surprising = climbs.filter((climb) => climb.surprise);

    function show() {
      const wanted = rayproof.address();
      const named = data.ladders.find((ladder) => ladder.ladder === wanted.ladder);
      const slot = slots.includes(wanted.slot) ? wanted.slot : named ? slotOf(named.climbs[0].formula) : slots[0];
      const precision = precisions.includes(wanted.precision) ? wanted.precision : precisions[0];
      const formulas = distinct(climbs.map((climb) => climb.formula)).filter((name) => slotOf(name) === slot);
      const ladders = data.ladders.filter((ladder) => ladder.climbs.some((climb) => slotOf(climb.formula) === slot));
      const pick = (key, title, values, value) => rayproof.select(title, values.map((one) => [one, one]), value, (chosen) => { rayproof.amend({ [key]: chosen, ladder: "" }); show(); });
      rayproof.replace(controls, pick("slot", "slot", slots, slot), pick("precision", "precision", precisions, precision));
      rayproof.replace(body, breakpoints(ladders, formulas, precision), e("div", { class: "ladders" }, ladders.map((ladder) => ladderCard(ladder, precision, formulas))));
      if (named) requestAnimationFrame(() => document.getElementById(`ladder-${named.ladder}`)?.scrollIntoView());
    }

    show();
    return [headline(data), surprising.length ? e("section", { class: "panel" }, e("h2", {}, "Surprises"), e("ul", {}, surprising.map((climb) =>
      e("li", {}, e("strong", {}, climb.formula), ` ${climb.precision}: ${climb.surprise}`)))) : null, e("section", { class: "panel" }, controls), body];
  }

  rayproof.addPage("stability", { title: "Stability", has: () => true, view: (results) => (results.plots?.stability ? rayproof.later(stabilityView(results))
    : [e("h1", {}, "Stability"), unmeasured("the ladders: how errors grow as inputs become ill-conditioned, and the breakpoint of every formula", "stability")]) });

  // The worst inputs of formulas, as `rayproof worst` found them.
  async function worstView(results) {
    const data = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.worst)));
    const again = (formula) => `rayproof worst ${rayproof.quoted(formula)} --precision ${data.precision} --seconds ${data.seconds} --seed ${data.origin.seed}`;
    const card = (one) => e("section", { class: "panel", "aria-label": `${one.formula}, ${one.ladder}` },
      e("h2", {}, one.formula, " ", e("span", { class: "muted" }, `inputs of ${one.ladder}, ${data.precision}: ${one.tried} tried, ${one.beyond} of the worst ${one.scores.length} beyond their limit`)),
      e("p", {}, `The worst ${one.scores.length}: ${one.common.join("; ")}.`),
      rayproof.scroll(`worst inputs of ${one.formula}`, e("table", {},
        e("thead", {}, e("tr", {}, ["kind", "limits", "inputs"].map(th))),
        e("tbody", {}, one.worst.map(([, , kind, limits, inputs]) => e("tr", {}, e("td", {}, kind), e("td", { class: "figure" }, limits), e("td", {}, e("code", {}, inputs))))))),
      rayproof.command(again(one.formula)));
    return [e("section", { class: "panel" }, e("h1", {}, "The worst inputs of formulas"),
      e("p", { class: "muted" }, "Found by evolution. An error is in units of its limit; a wrong decision counts by how many roundings of all inputs it clears every edge, in units of 16. What is more than 1 is wrong.")),
    e("div", {}, data.formulas.map(card))];
  }

  rayproof.addPage("worst", { title: "Worst inputs", has: (results) => Boolean(results.plots?.worst),
    view: (results) => rayproof.later(worstView(results)) });

  // How far whole renderers carry: a bar each on the logarithmic axis of every ladder of scenes.
  function limitRow(bar, own) {
    const why = [bar.blame, bar.reason].filter(Boolean).join(": ");
    return e("tr", {}, e("th", { scope: "row" }, own ? e("strong", {}, bar.renderer) : bar.renderer),
      e("td", { class: "reach" }, e("span", { class: own ? "reached own" : "reached", style: `width: ${Math.max(1, 100 * bar.share)}%`, role: "img",
        "aria-label": `${Math.round(100 * bar.share)} % of the axis` })),
      e("td", { class: "figure" }, bar.text), e("td", { title: why }, bar.blame));
  }

  async function limitsView(results) {
    const data = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.limits)));
    const card = (scale) => e("section", { class: "panel", "aria-label": scale.quantity },
      e("h2", {}, scale.quantity, " ", e("span", { class: "muted" }, `${scale.unit ? `[${scale.unit}] ` : ""}${rayproof.short(scale.values[0])} to ${rayproof.short(scale.values.at(-1))}, logarithmic`)),
      rayproof.scroll(`limits of ${scale.ladder}`, e("table", { class: "limits" },
        e("thead", {}, e("tr", {}, ["renderer", "", "right up to", "blamed beyond"].map(th))),
        e("tbody", {}, data.bars.filter((bar) => bar.ladder === scale.ladder).map((bar) => limitRow(bar, bar.renderer === data.renderers[0]))))),
      rayproof.command(`rayproof limits --subject ${rayproof.quoted(data.renderers[0].startsWith("tracer") ? "tracer" : data.renderers[0])} ${scale.ladder}`));
    return [e("section", { class: "panel" }, e("h1", {}, `How far ${data.renderers[0]} carries`),
      e("p", { class: "muted" }, "The last rung of each ladder of scenes up to which every rung passes. all: to the ladder's end. *: some rungs beyond pass again. undecided: float64 itself, or the pixels at edges, leave nothing to judge by.")),
    e("div", { class: "ladders" }, data.ladders.map(card))];
  }

  rayproof.addPage("limits", { title: "Limits", has: (results) => Boolean(results.plots?.limits),
    view: (results) => rayproof.later(limitsView(results)) });

  // Error against run time: work-precision diagrams, with the front of what nothing else beats.
  const hueOf = (point) => point.variant || point.renderer;
  const finite = (value) => typeof value === "number" && Number.isFinite(value);

  // Why a point has no error: what decides no pixel rightly has none.
  const lost = (point) => (finite(point.error) ? "" : point.wrong >= 1 ? "all wrong" : `no error, ${(100 * point.wrong).toPrecision(2)} % wrong`);

  function traces(diagram) {
    const drawn = diagram.points.filter((point) => finite(point.error) && finite(point.nanoseconds));
    const without = diagram.points.filter((point) => lost(point) && finite(point.nanoseconds));
    const hues = [...new Set([...drawn, ...without].map(hueOf))];
    // At the upper edge, a decade above every error.
    const edge = 10 * Math.max(1e-12, ...drawn.map((point) => (finite(point.error_high) ? point.error_high : point.error)));
    const edges = hues.map((hue, index) => [index, without.filter((point) => hueOf(point) === hue)]).filter(([, list]) => list.length).map(([index, list]) => ({
      x: list.map((point) => point.nanoseconds), y: list.map(() => edge), mode: "markers", type: "scatter", name: rayproof.plotText(`${hueOf(list[0])} (${lost(list[0])})`),
      customdata: list, text: list.map((point) => rayproof.plotText(`${point.label}: ${lost(point)}`)), hovertemplate: "%{text}<br>%{x:.3g} ns<extra></extra>",
      marker: { color: rayproof.hue(index), size: 11, symbol: "triangle-down" } }));
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
      hoverinfo: "skip", line: { dash: "dash", width: 1, color: "#8a949e" } }, ...groups.filter((group) => group.x.length), ...edges];
  }

  // What measures this point again, and the cases of its family where the run has some.
  function origin(results, diagram, point) {
    const [slot, ...rest] = diagram.name.split("/");
    const family = rest.join("/");
    const command = diagram.kind === "ladders" ? `rayproof stability ${slotless(point)} ${rayproof.quoted(family)} --precision ${point.precision}`
      : family === "overall" ? "rayproof tradeoff" : `rayproof tradeoff ${rayproof.quoted(family)}`;
    const cases = results.cases.some((row) => row.family === family) ? e("p", {}, e("a", { href: rayproof.link({ family }) }, `cases of ${family}`)) : null;
    const ladder = diagram.kind === "ladders" && results.plots?.stability ? e("p", {}, e("a", { href: rayproof.link({ page: "stability", ladder: family }) }, `ladder ${family}`)) : null;
    return [cases, ladder, rayproof.command(command)];

    function slotless(one) { return one.variant ? rayproof.quoted(`*/${one.variant}`) : ""; }
  }

  function diagramCard(results, diagram) {
    const chosen = e("div", { role: "status" });
    const onpoint = (point) => rayproof.replace(chosen, e("p", {}, e("strong", {}, point.label), `: ${rayproof.short(point.nanoseconds)} ns [${rayproof.short(point.nanoseconds_low)}, ${rayproof.short(point.nanoseconds_high)}] by ${point.clock === "wall" ? "the wall's clock" : "kernel times"}, ${lost(point) || `error ${rayproof.short(point.error)} [${rayproof.short(point.error_low)}, ${rayproof.short(point.error_high)}]`}`,
      finite(point.natural) ? `, ${rayproof.short(point.natural)} ${point.unit}` : "", point.wrong ? `, ${rayproof.short(100 * point.wrong)} % ${diagram.kind === "paths" ? "less exact than declared" : "decided wrongly"}` : ""), origin(results, diagram, point));
    const table = e("details", { ontoggle: () => { if (table.open && table.children.length === 1) table.append(numbers(diagram, onpoint)); } }, e("summary", {}, "numbers"));
    return e("section", { class: "panel ladder", "aria-label": diagram.name }, e("h2", {}, diagram.name, " ", e("span", { class: "muted" }, "faster to the left, more accurate below")),
      rayproof.plot(`${diagram.name}: ${diagram.error_axis} over ${diagram.time_axis}`, () => ({ traces: traces(diagram), onpoint,
        instead: () => e("img", { src: `tradeoff/${encodeURIComponent(diagram.svg)}`, alt: diagram.name, loading: "lazy" }),
        layout: { xaxis: { type: "log", title: { text: rayproof.plotText(diagram.time_axis) } }, yaxis: { type: "log", title: { text: rayproof.plotText(diagram.error_axis) } } } })),
      chosen, table);
  }

  function numbers(diagram, onpoint) {
    const cells = (point) => [rayproof.short(point.nanoseconds), lost(point) || rayproof.short(point.error), point.wrong ? `${rayproof.short(100 * point.wrong)} %` : ""];
    return rayproof.scroll("table of points", e("table", {},
      e("thead", {}, e("tr", {}, ["", diagram.time_axis, diagram.error_axis, "wrong", "front"].map((title) => e("th", { scope: "col" }, title)))),
      e("tbody", {}, [...diagram.points].sort((a, b) => a.nanoseconds - b.nanoseconds).map((point) => e("tr", {},
        e("th", { scope: "row" }, e("button", { class: "link", onclick: () => onpoint(point) }, point.label)),
        cells(point).map((text) => e("td", { class: "figure" }, text)), e("td", {}, point.front ? rayproof.glyph("pass") : ""))))));
  }

  async function tradeoffView(results) {
    const data = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.tradeoff)));
    const order = [...data.diagrams].sort((a, b) => b.name.endsWith("/overall") - a.name.endsWith("/overall"));
    return [e("section", { class: "panel" }, e("h2", {}, "Work-precision diagrams"),
      e("p", { class: "muted" }, `${data.repetitions} interleaved repetitions; intervals of 95 %. Filled: on the front. Circles float32, squares float64, crosses formulas that are kept as wrong, triangles at the upper edge formulas that decide all pixels wrongly.`),
      results.alone ? null : e("p", {}, e("a", { href: "tradeoff/tradeoff.csv" }, "all numbers as CSV"))),
    e("div", { class: "ladders" }, order.map((diagram) => diagramCard(results, diagram)))];
  }

  // What a run measures anyway: the worst error over its limit of each case, configuration and reference, and the time.
  const [LEAST, MOST] = [1e-6, 1e9]; // error / limit: what lies beyond, as 0 and inf do, is drawn there
  const FEW = 50; // rows of the table at first

  async function timesView(results) {
    const { configurations, references, stages, rows } = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.times)));
    const kernels = rows.some((row) => row[3] > 0);
    const chosen = { configuration: "", reference: "" }, body = e("tbody"), more = e("p"), picture = e("div"), controls = e("div", { class: "controls" });
    let points = [], shown = 0;
    const size = (point) => rayproof.number(point.ratio);
    const table = e("table", {}, e("thead", {}, e("tr", {}, ["case", "configuration", "reference", "stage", "error / limit", "time [ms]", "launches", "the reference's time [ms]"].map((title) =>
      e("th", { scope: "col", "data-name": title }, title === "error / limit" ? rayproof.ratioHead(title) : title)))), body);
    const line = (point) => e("tr", {}, e("th", { scope: "row" }, e("a", { href: rayproof.link({ case: point.case.name, stage: point.stage }) }, e("bdi", {}, rayproof.parts(point.case.name)))),
      e("td", {}, rayproof.parts(point.configuration)), e("td", {}, point.reference), e("td", {}, point.stage), e("td", {}, rayproof.ratioBar(point.ratio)),
      e("td", { class: "figure" }, rayproof.short(point.time)), e("td", { class: "figure" }, point.launches || "1 render"), e("td", { class: "figure" }, point.theirs === null ? "from the cache" : rayproof.short(point.theirs)));

    function next() {
      rayproof.append(body, points.slice(shown, shown + FEW).map(line));
      rayproof.named(table);
      shown = Math.min(points.length, shown + FEW);
      rayproof.replace(more, shown < points.length ? e("button", { class: "quiet", onclick: next }, `show more of ${points.length}`) : null);
    }

    // A point a case and configuration: by the reference against which it does worst.
    function plot() {
      const worst = new Map();
      for (const point of points) if (!worst.has(point.row)) worst.set(point.row, point); // they come worst first
      const traces = configurations.map((name, i) => {
        const own = [...worst.values()].filter((point) => point.configuration === name);
        return { x: own.map((point) => point.time), y: own.map((point) => Math.min(MOST, Math.max(LEAST, size(point)))), type: "scatter", mode: "markers", name: rayproof.plotText(name), customdata: own,
          text: own.map((point) => rayproof.plotText(`${point.case.name}, ${point.reference}, ${point.stage}: ${rayproof.short(point.ratio)} of the limit, ${rayproof.short(point.time)} ms`)), hovertemplate: "%{text}<extra></extra>",
          marker: { color: rayproof.hue(i), symbol: rayproof.symbol(i), size: 6, opacity: 0.75 } };
      }).filter((trace) => trace.x.length);
      return { traces, instead: () => null, onpoint: (point) => { location.hash = rayproof.link({ case: point.case.name, stage: point.stage }); },
        layout: { xaxis: { type: "log", title: { text: kernels ? "time of the kernels of a launch [ms]" : "time of a render [ms]" } }, yaxis: { type: "log", title: { text: "worst error / limit" } },
          shapes: [{ type: "line", xref: "paper", x0: 0, x1: 1, y0: 1, y1: 1, line: { dash: "dash", width: 1, color: "#8a949e" } }],
          annotations: [{ xref: "paper", x: 1, y: 0, text: "limit", showarrow: false, xanchor: "right", yanchor: "bottom", font: { color: "#8a949e" } }] } };
    }

    function show() {
      points = rows.flatMap((row) => row[4].map(([reference, ratio, stage, theirs]) => ({ row, case: results.cases[row[0]], configuration: configurations[row[1]], time: row[2], launches: row[3],
        reference: references[reference], ratio, stage: stages[stage], theirs }))).filter((point) => ["configuration", "reference"].every((key) => !chosen[key] || point[key] === chosen[key]))
        .sort((a, b) => size(b) - size(a) || b.time - a.time);
      shown = 0;
      body.replaceChildren();
      rayproof.replace(picture, rayproof.plot("worst error over limit against time", plot));
      next();
    }
    const pick = (key, values) => rayproof.select(key, [["", `any ${key}`], ...values.map((name) => [name, name])], "", (value) => { chosen[key] = value; show(); });
    rayproof.append(controls, [pick("configuration", configurations), pick("reference", references)]);
    show();
    return e("section", { class: "panel", "aria-label": "Error against time of this run" }, e("h2", {}, "This run"),
      e("p", { class: "muted" }, kernels ? "The tracer's time is that of its kernels without compiling, the median of its launches. A reference's time is that of its whole render." : "The time is that of a whole render, from the call to the image."),
      e("p", { class: "muted" }, `Each point is a case and a configuration, with its largest error over limit among the references. A click opens the case. The dashed line is the limit. Points below ${LEAST} or above ${rayproof.short(MOST)} are drawn on the edge.`),
      controls, picture, rayproof.scroll("table of errors and times", table), more);
  }

  rayproof.addPage("tradeoff", { title: "Error against time", has: () => true, view: (results) => [e("h1", {}, "Error against time"),
    results.plots?.times ? rayproof.later(timesView(results)) : e("p", { class: "panel muted" }, "Nothing was measured in this run."),
    results.plots?.tradeoff ? rayproof.later(tradeoffView(results)) : unmeasured("work-precision diagrams: error against time of every formula of a slot, in both precisions", "tradeoff")] });
})(window.rayproof);
