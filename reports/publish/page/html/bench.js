// Our frames beside other renderers': times as ratios with their intervals, how far from the limit, and error against time.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const th = (title) => e("th", { scope: "col" }, title);
  const place = (scene) => `${scene.name}, ${scene.width}\u00D7${scene.height}`;
  const milliseconds = (value) => (rayproof.number(value) === null ? "" : `${rayproof.short(value)} ms`);
  const percent = (value, digits) => (rayproof.number(value) === null ? "\u2013" : `${(100 * rayproof.number(value)).toFixed(digits)} %`);
  const command = (names) => rayproof.command(["rayproof bench", ...names.map((name) => rayproof.quoted(String(name)))].join(" "));

  // How many scenes the interval leaves no doubt about.
  function tally(scenes, key) {
    const timed = scenes.filter((scene) => scene[`${key}_interval`]);
    const faster = timed.filter((scene) => rayproof.number(scene[`${key}_interval`][0]) > 1).length;
    return `${faster} of ${timed.length}`;
  }

  function table(scenes, choose) {
    const axis = rayproof.intervals(scenes.flatMap((scene) => [scene.ratio_minimal_interval, scene.ratio_direct_interval]), 1, { log: true, width: 80 });
    const words = (scene, key) => (rayproof.number(scene[key]) === null ? "\u2013" : `${rayproof.number(scene[key]).toFixed(2)} ${rayproof.between(scene[`${key}_interval`], 2)}`);
    const ratio = (scene, key) => cell(axis(scene[key], scene[`${key}_interval`], words(scene, key)));
    const cell = (...content) => e("td", { class: "figure" }, content);
    const row = (scene) => e("tr", {},
      e("th", { scope: "row" }, e("button", { class: "link", title: String(scene.about ?? ""), onclick: () => choose(scene) }, scene.name), e("span", { class: "muted" }, ` ${scene.width}\u00D7${scene.height}`)),
      cell(milliseconds(scene.ours_ms)), ratio(scene, "ratio_minimal"), ratio(scene, "ratio_direct"), cell(words(scene, "control")),
      cell(percent(scene.pixels_differ, 3)), cell([scene.error?.median, scene.error?.p99].map((value) => rayproof.short(value, 2)).filter(Boolean).join(", ")),
      cell(milliseconds(scene.compile_ms)), cell(milliseconds(scene.build_ms)),
      cell(percent(scene.limit_fraction, 0)));
    return rayproof.scroll("table of scenes", e("table", { class: "bench" },
      e("thead", {}, e("tr", {}, ["scene", "ours", "minimal Mitsuba / ours", "Mitsuba direct / ours", "ours / ours", "pixels differ",
        "error: median, p99", "compile", "build", "of limit"].map(th))), e("tbody", {}, scenes.map(row))));
  }

  // Everybody on one scene.
  function contenders(scene) {
    const row = ([name, one]) => e("tr", {}, e("th", { scope: "row" }, name),
      one.left_out ? e("td", { colspan: 7, class: "muted" }, one.left_out)
        : [e("td", {}, one.does), ...[one.ms, one.fastest_ms].map((value) => e("td", { class: "figure" }, milliseconds(value))),
          e("td", { class: "figure" }, one.rounds), ...[one.first_ms, one.build_ms].map((value) => e("td", { class: "figure" }, milliseconds(value))),
          e("td", { class: "figure" }, rayproof.short(one.error?.p99))]);
    return [e("h3", { class: "apart" }, place(scene), " ", e("span", { class: "muted" }, [scene.about, scene.lights && `${scene.lights} light${scene.lights === 1 ? "" : "s"}`,
      scene.operations && `${rayproof.short(scene.operations)} operations`, scene.limit_by && `limited by ${scene.limit_by}`].filter(Boolean).join(" \u00B7 "))),
    rayproof.scroll("table of contenders", e("table", {}, e("thead", {}, e("tr", {}, ["contender", "one run is", "median", "fastest", "rounds", "first", "build", "error, p99"].map(th))),
      e("tbody", {}, Object.entries(scene.contenders || {}).map(row)))), command([scene.name])];
  }

  const positive = (value) => (rayproof.number(value) > 0 && Number.isFinite(rayproof.number(value)) ? rayproof.number(value) : null);

  // Per pixel, so that sizes compare; scenes in which a contender has no error have no place on a logarithm.
  function traces(scenes) {
    const names = [...new Set(scenes.flatMap((scene) => Object.keys(scene.contenders || {})))];
    return names.map((name, index) => {
      const drawn = scenes.map((scene) => ({ scene, x: positive(1e6 * scene.contenders?.[name]?.ms / (scene.width * scene.height)), y: positive(scene.contenders?.[name]?.error?.p99) }))
        .filter(({ x, y }) => x && y);
      return { x: drawn.map(({ x }) => x), y: drawn.map(({ y }) => y), mode: "markers", type: "scatter", name: rayproof.plotText(name), customdata: drawn.map(({ scene }) => scenes.indexOf(scene)),
        text: drawn.map(({ scene }) => rayproof.plotText(`${name}: ${place(scene)}`)), hovertemplate: "%{text}<br>%{x:.3g} ns a pixel, error %{y:.3g}<extra></extra>",
        marker: { color: rayproof.hue(index), symbol: rayproof.symbol(index), size: 9 } };
    }).filter((trace) => trace.x.length);
  }

  const facts = (found) => e("dl", { class: "facts" }, Object.entries(found).flatMap(([key, value]) =>
    (value !== null && typeof value === "object" ? Object.entries(value).map(([more, inner]) => [`${key} ${more}`, inner]) : [[key, value]])
      .map(([name, number]) => [e("dt", {}, name.replaceAll("_", " ")), e("dd", {}, rayproof.number(number) === null ? String(number) : rayproof.short(number))])));

  async function view(results) {
    const found = JSON.parse(await rayproof.inflateText(await rayproof.request(results.plots.bench)));
    const { scenes } = found;
    const chosen = e("div", { role: "status" });
    const choose = (scene) => rayproof.replace(chosen, contenders(scene));
    choose(scenes[0]);
    return [e("section", { class: "panel" }, e("h1", {}, `Benchmark of ${scenes.length} scene${scenes.length === 1 ? "" : "s"}`),
      e("p", {}, `Faster without doubt: than a minimal Mitsuba kernel in ${tally(scenes, "ratio_minimal")}, than Mitsuba's direct integrator in ${tally(scenes, "ratio_direct")}.`),
      e("p", { class: "muted" }, `${String(found.started ?? "").slice(0, 16).replace("T", " ")} \u00B7 warm and frozen, in turns with the others; ratios within rounds, intervals of 95 %; our own time over our own is what the machine does to a ratio of 1.`),
      command([])),
    found.changes.length ? e("section", { class: "panel", "aria-label": "Changes" }, e("h2", {}, "Against an earlier benchmark"), e("ul", {}, found.changes.map((one) =>
      e("li", {}, `${place(one)}: ${one.verdict}, time \u00D7${rayproof.short(one.change)} ${rayproof.between(one.interval, 2)}`)))) : null,
    e("section", { class: "panel", "aria-label": "Scenes" }, table(scenes, choose), chosen),
    e("section", { class: "panel ladder", "aria-label": "Error against run time" }, e("h2", {}, "Error against run time ", e("span", { class: "muted" }, "faster to the left, more accurate below; a point opens its scene")),
      rayproof.plot("error over nanoseconds a pixel", () => ({ traces: traces(scenes), onpoint: (index) => { choose(scenes[index]); chosen.scrollIntoView({ block: "nearest" }); },
        instead: () => e("p", { class: "muted" }, "The table above has the numbers."),
        layout: { xaxis: { type: "log", title: { text: "time [ns a pixel]" } }, yaxis: { type: "log", title: { text: "relative error, 99th percentile" } } } }))),
    e("section", { class: "panel", "aria-label": "Machine" }, e("h2", {}, "The machine ", e("span", { class: "muted" }, "measured peaks, a second")), facts(found.machine), e("h3", { class: "apart" }, "Versions"), facts(found.versions))];
  }

  rayproof.addPage("bench", { title: "Benchmark", has: (results) => Boolean(results.plots?.bench), view: (results) => rayproof.later(view(results)) });
})(window.rayproof);
