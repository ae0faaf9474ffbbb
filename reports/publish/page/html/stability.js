// Where formulas stop being right: breakpoints as a table, and every ladder with its slopes.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const slotOf = (formula) => formula.slice(0, formula.indexOf("/"));
  const distinct = (values) => [...new Set(values)];
  const th = (title) => e("th", { scope: "col" }, title);

  // As expected, known to fail, or a surprise: a shape and a word for each.
  function state(climb) {
    if (climb.surprise) return ["fail", "surprise"];
    return climb.verdict === "pass" ? ["pass", "pass"] : ["unsupported", "known to fail"];
  }
  function mark(climb) {
    const [name, word] = state(climb);
    return e("span", { class: `glyph mark ${rayproof.tone(name)}`, title: climb.surprise || climb.known || word }, rayproof.glyph(name));
  }

  const command = (ladder, climb) => `rayproof stability ${rayproof.quoted(climb.formula)} --ladder ${rayproof.quoted(ladder.ladder)} --precision ${climb.precision}`;

  function breakpoints(ladders, formulas, precision) {
    const cell = (ladder, formula) => {
      const climb = ladder.climbs.find((one) => one.formula === formula && one.precision === precision);
      if (!climb) return e("td");
      const value = climb.breakpoint === null ? "none" : rayproof.short(climb.breakpoint, 2);
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
        e("td", { class: "figure" }, rayproof.short(climb.slope_predicted)), e("td", { class: "figure" }, rayproof.short(climb.breakpoint) || "none"),
        e("td", { class: "figure" }, rayproof.short(climb.worst_error_over_Ku)),
        e("td", {}, Object.entries(climb.per_million || {}).map(([name, count]) => `${name.replaceAll("_", " ")} ${rayproof.short(count)}`).join(", ")),
        e("td", {}, climb.surprise || climb.known || (climb.reasons || []).join("; ")))))));
  }

  function card(ladder, precision, formulas) {
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
      table, rayproof.command(`rayproof stability --ladder ${rayproof.quoted(ladder.ladder)} --precision ${precision}`));
  }

  function headline({ ladders, about }) {
    const climbs = ladders.flatMap((ladder) => ladder.climbs);
    const surprises = climbs.filter((climb) => climb.surprise).length + (about.doubts || []).length;
    const tone = surprises ? "fail" : "pass";
    return e("section", { class: `verdict ${rayproof.tone(tone)}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(tone)),
      e("div", {}, e("h1", {}, `${ladders.length} ladders, ${climbs.length} climbs, ${climbs.filter((climb) => climb.expected === "fail").length} known failures, ${surprises} surprise${surprises === 1 ? "" : "s"}`),
        e("p", { class: "muted" }, [about.quick ? "few rays (--quick)" : null, about.environment?.backend, Object.entries(about.subnormals || {}).map(([name, word]) => `${name} subnormals ${word}`).join(", ")].filter(Boolean).join(" \u00B7 "))));
  }

  async function view(results) {
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
      rayproof.replace(body, breakpoints(ladders, formulas, precision), e("div", { class: "ladders" }, ladders.map((ladder) => card(ladder, precision, formulas))));
      if (named) requestAnimationFrame(() => document.getElementById(`ladder-${named.ladder}`)?.scrollIntoView());
    }

    show();
    return [headline(data), surprising.length ? e("section", { class: "panel" }, e("h2", {}, "Surprises"), e("ul", {}, surprising.map((climb) =>
      e("li", {}, e("strong", {}, climb.formula), ` ${climb.precision}: ${climb.surprise}`)))) : null, e("section", { class: "panel" }, controls), body];
  }

  rayproof.addPage("stability", { title: "Stability", has: (results) => Boolean(results.plots?.stability),
    view: (results) => rayproof.later(view(results)) });
})(window.rayproof);
