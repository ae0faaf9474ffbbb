// How the run stands among those before it: what became worse, and error and time of each case over runs.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const WHAT = { verdict: "fail", error: "warn", time: "warn" };

  const load = async (results) => JSON.parse(await rayproof.inflateText(await rayproof.request(results.history.data)));

  function sentences(results, most) {
    const { worse } = results.history;
    const known = new Set(results.cases.map((row) => row.name));
    return e("ul", {}, worse.slice(0, most).map((entry) => e("li", {}, e("span", { class: `glyph mark ${rayproof.tone(WHAT[entry.what] || "warn")}`, "aria-hidden": "true" }, rayproof.glyph(WHAT[entry.what] || "warn")), " ",
      known.has(entry.case) ? e("a", { href: rayproof.link({ case: entry.case }) }, e("bdi", {}, entry.sentence)) : e("bdi", {}, entry.sentence))));
  }

  // On the front page: what is worse than it was, first of all.
  rayproof.worse = function (results) {
    if (!results.history?.worse.length) return null;
    const many = results.history.worse.length;
    return e("section", { class: "panel", "aria-label": "Worse than its history" },
      e("h2", {}, "Worse than its history ", e("span", { class: "muted" }, `run ${results.history.run} of ${results.history.file}`)),
      sentences(results, 8),
      e("p", { class: "muted" }, many > 8 ? `and ${many - 8} more: ` : "", e("a", { href: rayproof.link({ page: "history" }) }, "errors and times over all runs")));
  };

  function pair(name, series) {
    const href = rayproof.link({ case: name });
    const take = (place) => series.points.map(([run, revision, verdict, ...values]) => ({ run, revision, verdict, value: rayproof.number(values[place]) }));
    const plot = (title, more) => e("figure", {}, e("figcaption", { class: "muted" }, title), rayproof.seriesPlot(`${title} of ${name} over runs`, { ...more, href }));
    return [plot("worst error / limit", { points: take(0), steps: series.error_steps, unit: "", limit: 1 }),
      plot("time [s]", { points: take(1).map((point) => ({ ...point, value: point.value > 0 ? point.value : null })), steps: series.time_steps, unit: " s" })];
  }

  // A row of the page; drawn when it comes near the screen.
  function row(name, series, verdict) {
    const plots = e("div", { class: "twin" });
    const seen = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      seen.disconnect();
      rayproof.append(plots, pair(name, series));
    }, { rootMargin: "300px" });
    seen.observe(plots);
    const title = verdict ? [rayproof.pill(verdict), " ", e("a", { href: rayproof.link({ case: name }) }, e("bdi", {}, name))]
      : [e("bdi", {}, name), e("span", { class: "muted" }, " not in this run")];
    return e("section", { class: "panel past", "aria-label": name }, e("h3", {}, title), plots);
  }

  const lastStep = (series) => Math.max(-1, ...[...series.error_steps, ...series.time_steps].map(([run]) => run));

  // What became worse first, then the latest steps, then the largest errors.
  function order(results, cases) {
    const worse = results.history.worse.map((entry) => entry.case);
    const rank = (name) => (worse.includes(name) ? worse.indexOf(name) : worse.length);
    const ratio = (series) => rayproof.number(series.points.at(-1)?.[3]) ?? -1;
    return Object.entries(cases).filter(([, series]) => series.points.length)
      .sort(([a, one], [b, other]) => rank(a) - rank(b) || lastStep(other) - lastStep(one) || ratio(other) - ratio(one) || (a < b ? -1 : 1));
  }

  async function view(results) {
    const rows = order(results, await load(results));
    const verdicts = new Map(results.cases.map((item) => [item.name, item.verdict]));
    const body = e("div"), count = e("span", { class: "muted", role: "status" });
    const many = results.history.worse.length;
    function show() {
      const words = (rayproof.address().q || "").toLowerCase().split(/\s+/).filter(Boolean);
      const found = rows.filter(([name]) => words.every((word) => name.toLowerCase().includes(word)));
      rayproof.replace(count, `${found.length} of ${rows.length} cases: what became worse first, then the latest steps`);
      rayproof.replace(body, found.map(([name, series]) => row(name, series, verdicts.get(name))));
    }
    const search = e("input", { type: "search", "aria-label": "search cases", placeholder: "name \u2026", value: rayproof.address().q || "",
      oninput: () => { rayproof.amend({ q: search.value }); show(); } });
    show();
    return [e("section", { class: `verdict ${rayproof.tone(many ? "warn" : "pass")}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(many ? "warn" : "pass")),
      e("div", {}, e("h1", {}, many ? `${many} thing${many === 1 ? " is" : "s are"} worse than before` : "Nothing is worse than before"),
        e("p", { class: "muted" }, `run ${results.history.run} of ${results.history.file}`))),
    many ? e("section", { class: "panel" }, sentences(results, many)) : null,
    e("section", { class: "panel" }, e("div", { class: "controls" }, e("label", { class: "control grow" }, e("span", {}, "search"), search)), count,
      e("p", { class: "muted legend" }, "Circles passed, triangles warned, crosses did worse. Dashed: a step, upwards \u25B2 or downwards \u25BC by that factor; dotted: the limit. A point opens its case.")),
    body];
  }

  // On the page of a case: its own past, where there is more than this run.
  rayproof.past = function (results, name) {
    if (!results.history) return null;
    const node = e("section", { class: "panel past", "aria-label": "History", hidden: true }, e("h2", {}, "History"));
    load(results).then((cases) => {
      if (!(cases[name]?.points.length > 1)) return;
      node.hidden = false;
      rayproof.append(node, [e("div", { class: "twin" }, pair(name, cases[name]))]);
    }, (error) => { node.hidden = false; rayproof.append(node, [e("p", { class: "muted" }, error.message)]); });
    return node;
  };

  rayproof.addPage("history", { title: "History", has: (results) => Boolean(results.history), view: (results) => rayproof.later(view(results)) });
})(window.rayproof);
