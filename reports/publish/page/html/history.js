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

  function pair(name, points) {
    const href = rayproof.link({ case: name });
    const take = (place) => points.map(([run, revision, verdict, ...values]) => ({ run, revision, verdict, value: rayproof.number(values[place]) }));
    const plot = (title, more) => e("figure", {}, e("figcaption", { class: "muted" }, title), rayproof.seriesPlot(`${title} of ${name} over runs`, { ...more, href }));
    return [plot("worst error / limit", { points: take(0), unit: "", limit: 1 }),
      plot("time [s]", { points: take(1).map((point) => ({ ...point, value: point.value > 0 ? point.value : null })), unit: " s" })];
  }

  // A row of the page; drawn when it comes near the screen.
  function historyRow(name, points, verdict) {
    const plots = e("div", { class: "twin" });
    const seen = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      seen.disconnect();
      rayproof.append(plots, pair(name, points));
    }, { rootMargin: "300px" });
    seen.observe(plots);
    const title = verdict ? [rayproof.pill(verdict), " ", e("a", { href: rayproof.link({ case: name }) }, e("bdi", {}, name))]
      : [e("bdi", {}, name), e("span", { class: "muted" }, " not in this run")];
    return e("section", { class: "panel past", "aria-label": name }, e("h3", {}, title), plots);
  }

  // What became worse first, then the largest errors.
  function order(results, cases) {
    const worse = results.history.worse.map((entry) => entry.case);
    const rank = (name) => (worse.includes(name) ? worse.indexOf(name) : worse.length);
    const ratio = (points) => rayproof.number(points.at(-1)?.[3]) ?? -1;
    return Object.entries(cases).filter(([, points]) => points.length)
      .sort(([a, one], [b, other]) => rank(a) - rank(b) || ratio(other) - ratio(one) || (a < b ? -1 : 1));
  }

  async function historyView(results) {
    const rows = order(results, await load(results));
    const verdicts = new Map(results.cases.map((item) => [item.name, item.verdict]));
    const body = e("div"), count = e("span", { class: "muted", role: "status" });
    const many = results.history.worse.length;
    function show() {
      const words = (rayproof.address().q || "").toLowerCase().split(/\s+/).filter(Boolean);
      const found = rows.filter(([name]) => words.every((word) => name.toLowerCase().includes(word)));
      rayproof.replace(count, `${found.length} of ${rows.length} cases: what became worse first, then the largest errors`);
      rayproof.replace(body, found.map(([name, points]) => historyRow(name, points, verdicts.get(name))));
    }
    const search = e("input", { type: "search", "aria-label": "search cases", placeholder: "name \u2026", value: rayproof.address().q || "",
      oninput: () => { rayproof.amend({ q: search.value }); show(); } });
    show();
    return [e("section", { class: `verdict ${rayproof.tone(many ? "warn" : "pass")}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(many ? "warn" : "pass")),
      e("div", {}, e("h1", {}, many ? `${many} thing${many === 1 ? " is" : "s are"} worse than before` : "Nothing is worse than before"),
        e("p", { class: "muted" }, `run ${results.history.run} of ${results.history.file}`))),
    many ? e("section", { class: "panel" }, sentences(results, many)) : null,
    e("section", { class: "panel" }, e("div", { class: "controls" }, e("label", { class: "control grow" }, e("span", {}, "search"), search)), count,
      e("p", { class: "muted legend" }, "Circles passed, triangles warned, crosses did worse; dotted: the limit. A point opens its case.")),
    body];
  }

  // On the page of a case: its own past, where there is more than this run.
  rayproof.past = function (results, name) {
    if (!results.history) return null;
    const node = e("section", { class: "panel past", "aria-label": "History", hidden: true }, e("h2", {}, "History"));
    load(results).then((cases) => {
      if (!(cases[name]?.length > 1)) return;
      node.hidden = false;
      rayproof.append(node, [e("div", { class: "twin" }, pair(name, cases[name]))]);
    }, (error) => { node.hidden = false; rayproof.append(node, [e("p", { class: "muted" }, error.message)]); });
    return node;
  };

  rayproof.addPage("history", { title: "History", has: (results) => Boolean(results.history), view: (results) => rayproof.later(historyView(results)) });

  // Two runs side by side: what changed on the front page, worst first, and every check before and after on a case's.
  const th = (title) => e("th", { scope: "col" }, title);

  // By how much an error over its limit grew: an arrow beside the number.
  function factor(value) {
    value = rayproof.number(value);
    if (value === null) return "";
    if (value === 1) return e("span", { class: "muted" }, "=");
    const up = !(value < 1);
    return e("span", { class: up ? "mark v-fail" : "mark v-pass" }, `${up ? "\u25B2" : "\u25BC"} \u00D7${rayproof.short(value, 2)}`);
  }

  const change = (before, after) => (before === after ? rayproof.pill(after) : [rayproof.pill(before), " \u2192 ", rayproof.pill(after)]);

  function worst(check) {
    if (!check) return e("span", { class: "muted" }, "no errors to compare");
    if (rayproof.number(check.factor) === 1) return e("span", { class: "muted" }, "no error changed");
    return [e("strong", {}, check.stage), e("span", { class: "muted" }, ` ${check.configuration} against ${check.reference}: `),
      `${rayproof.short(check.before[1], 2)} \u2192 ${rayproof.short(check.after[1], 2)} `, factor(check.factor)];
  }

  function time({ seconds: [before, after, quotient], stands_out: loud }) {
    return quotient === null ? "" : [`${rayproof.seconds(before)} \u2192 ${rayproof.seconds(after)}`, " ", loud ? factor(quotient) : null];
  }

  function comparedRow(results, item) {
    return e("tr", {}, e("td", {}, change(item.before, item.after)),
      e("th", { scope: "row", class: "name" }, e("a", { href: rayproof.link({ case: item.case, stage: item.stage }) }, e("bdi", {}, item.case))),
      e("td", {}, worst(item.worst)),
      e("td", { class: "figure" }, item.pixels === null ? e("span", { class: "muted" }, "not kept") : item.pixels === 0 ? e("span", { class: "muted" }, "identical") : item.pixels),
      e("td", { class: "figure" }, time(item)));
  }

  const listed = (title, names, link) => (names.length ? e("p", {}, e("strong", {}, `${title} (${names.length}): `), names.slice(0, 40).flatMap(([name, verdict], i) => [i ? ", " : "",
    link ? e("a", { href: rayproof.link({ case: name }) }, e("bdi", {}, name)) : e("bdi", {}, name), " ", rayproof.pill(verdict)]), names.length > 40 ? " \u2026" : "") : null);

  // On the front page: the table of what changed.
  rayproof.comparison = function (results) {
    const found = results.comparison;
    if (!found) return null;
    const side = (one) => [e("strong", {}, e("bdi", {}, one.name)), e("span", { class: "muted" }, ` ${[one.started ? String(one.started).slice(0, 16).replace("T", " ") : "", one.verdict].filter(Boolean).join(", ")}`)];
    const body = e("tbody"), more = e("p");
    let shown = 0;
    function next() {
      const part = found.rows.slice(shown, shown + 50);
      rayproof.append(body, part.map((item) => comparedRow(results, item)));
      shown += part.length;
      rayproof.replace(more, shown < found.rows.length ? e("button", { class: "quiet", onclick: next }, `show more of ${found.rows.length}`) : null);
    }
    next();
    return e("section", { class: "panel comparison", "aria-label": "What changed" }, e("h2", {}, "What changed"),
      e("p", {}, "from ", side(found.base), " to ", side(found.candidate), e("span", { class: "muted" }, "; this page is the latter's")),
      e("p", {}, found.sentence),
      found.rows.length ? rayproof.scroll("table of changes", e("table", {}, e("thead", {}, e("tr", {}, ["verdict", "case", "largest change of error / limit", "pixels that differ", "time"].map(th))), body)) : null, more,
      listed("appeared", found.appeared, true), listed("vanished", found.vanished, false));
  };

  // On a case's page: every check of both runs.
  rayproof.compared = function (results, data) {
    const found = data.compared;
    if (!results.comparison || !found) return null;
    const { base, candidate } = results.comparison;
    const side = (word) => (word ? [rayproof.pill(word[0]), " ", rayproof.short(word[1], 2)] : e("span", { class: "muted" }, "not made"));
    const line = (check) => e("tr", {}, e("th", { scope: "row" }, check.stage), e("td", {}, check.configuration), e("td", {}, check.reference),
      e("td", {}, side(check.before)), e("td", {}, side(check.after)), e("td", { class: "figure" }, factor(check.factor)));
    const apart = found.checks.filter((check) => rayproof.number(check.factor) !== 1 || check.before?.[0] !== check.after?.[0]);
    const images = found.pixels === null ? "images of both were not kept" : found.pixels ? `${found.pixels} pixels differ` : "the images are identical, bit for bit";
    return e("section", { class: "panel", "aria-label": "Before and after" }, e("h3", {}, "Before and after ", e("span", { class: "muted" }, `${apart.length} of ${found.checks.length} checks changed; ${images}`)),
      apart.length ? e("details", { open: apart.length <= 12 }, e("summary", {}, "error / limit of every check that changed"), rayproof.scroll("table of changed checks", e("table", {},
        e("thead", {}, e("tr", {}, ["stage", "configuration", "reference", base.name, candidate.name, "change"].map(th))), e("tbody", {}, apart.slice(0, 400).map(line))))) : null);
  };

  // Two formulas on the same rays: digits gained and time ratio of every family, with their intervals.
  const TONES = { better: "pass", worse: "fail", mixed: "warn" };
  const tone = (outcome) => TONES[outcome] || "unsupported";
  function contestView(results) {
    const { contest } = results;
    const digits = rayproof.intervals(contest.families.map((one) => one.digits_interval), 0);
    const times = rayproof.intervals(contest.families.map((one) => one.time_interval), 1, { log: true });
    const known = new Set(results.cases.map((row) => row.family));
    const line = (one) => {
      const [gained, ratio] = [rayproof.number(one.digits_gained), rayproof.number(one.time_ratio)];
      const wrong = one.wrong.length ? `${one.wrong[0]} \u2192 ${one.wrong[1]} of ${one.pixels}` : "";
      return e("tr", {}, e("td", {}, e("span", { class: `glyph mark ${rayproof.tone(tone(one.outcome))}`, "aria-hidden": "true" }, rayproof.glyph(tone(one.outcome))), " ", one.outcome),
        e("th", { scope: "row" }, known.has(one.family) ? e("a", { href: rayproof.link({ family: one.family }) }, one.family) : one.family, one.stress ? e("span", { class: "muted" }, " stress") : null),
        e("td", { class: "figure" }, digits(gained, one.digits_interval, gained === null ? "" : `${gained > 0 ? "+" : ""}${gained.toFixed(2)} ${rayproof.between(one.digits_interval, 2)}`)),
        e("td", { class: "figure" }, wrong),
        e("td", { class: "figure" }, times(ratio, one.time_interval, ratio === null ? "" : `\u00D7${ratio.toFixed(3)} ${rayproof.between(one.time_interval, 3)}`)),
        e("td", { class: "figure" }, (one.nanoseconds_per_ray || []).map((value) => rayproof.short(value)).join(" \u2192 ")));
    };
    return e("div", {}, e("section", { class: `verdict ${rayproof.tone(tone(contest.outcome))}` }, e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(tone(contest.outcome))),
      e("div", {}, e("h1", {}, `${contest.base} \u2192 ${contest.candidate}: ${contest.outcome}`), e("p", {}, contest.verdict),
        e("p", { class: "muted" }, `control, ${contest.base} against itself: ${contest.control}`))),
    e("section", { class: "panel contest", "aria-label": "Families" }, rayproof.scroll("table of families", e("table", {},
      e("thead", {}, e("tr", {}, ["", "family", "digits gained, more is better", "decided wrongly", "time ratio, less is better", "ns per ray"].map(th))),
      e("tbody", {}, contest.families.map(line)))),
    e("p", { class: "muted legend" }, "Intervals of all families hold together at 95 %; the upright line is where both are alike."),
    rayproof.command(`rayproof compare ${rayproof.quoted(String(contest.base))} ${rayproof.quoted(String(contest.candidate))}`)));
  }

  rayproof.addPage("contest", { title: "Comparison", has: (results) => Boolean(results.contest), view: contestView });
})(window.rayproof);
