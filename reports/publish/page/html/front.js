// Pages beside the front page. A script adds one by rayproof.addPage; it shows in the navigation where it has something.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  rayproof.pages = new Map();

  // has(results) -> whether there is anything to show; view(results) -> a node. Its address is #page=name.
  rayproof.addPage = (name, { title, has, view }) => rayproof.pages.set(name, { title, has, view });

  rayproof.navigation = function (results, current) {
    const pages = [...rayproof.pages].filter(([, page]) => page.has(results));
    if (!pages.length) return null;
    const link = (name, title) => e("a", { href: name ? rayproof.link({ page: name }) : "#", "aria-current": name === current ? "page" : null }, title);
    return e("nav", { class: "pages", "aria-label": "Pages" }, link("", "Cases"), pages.map(([name, page]) => link(name, page.title)));
  };

  rayproof.title = function (results, wanted) {
    const loud = results.shouts.length ? "! " : "";
    return `${loud}rayproof: ${wanted.case ?? rayproof.pages.get(wanted.page)?.title ?? results.standing ?? "report"}`;
  };

  // The first screen: shouts, the verdict in one line, the ledgers, what is blamed, and at the end the environment.
  rayproof.shoutBars = (results) => results.shouts.map((text) => e("p", { class: "shout", role: "alert" }, text));

  rayproof.verdictLine = function (results) {
    const verdict = String(results.verdict);
    return e("section", { class: `verdict ${rayproof.tone(verdict)}`, "aria-label": "Verdict" },
      e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(verdict)),
      e("div", {},
        e("h1", {}, results.headline),
        e("p", { class: "muted" }, [results.command, started(results.started), rayproof.seconds(results.seconds)]
          .filter(Boolean).flatMap((text, i) => (i ? [" \u00B7 ", text] : [rayproof.code(text)]))),
        counted(results.examined?.counts)));
  };

  const counted = (counts) => (counts?.pixels > 0 ? e("p", { class: "muted counted" }, [`${counts.pixels.toLocaleString("en")} pixels over all checks`,
    `${counts.wrong.toLocaleString("en")} wrong`, `${counts.unexamined.toLocaleString("en")} not examined`].join(", ")) : null);

  const started = (text) => (text ? String(text).slice(0, 16).replace("T", " ") : "");

  // planned = pass + warn + ..., for cases and for checks.
  rayproof.ledger = function (results, onpick) {
    const names = results.ledger.slice(1);
    // On a narrow screen numbers wrap, each with its word, and zeros are left out, so that what failed stays in sight.
    const empty = (name) => (results.summary[name] || results.checks[name] ? "" : "empty");
    const row = (title, counts) => e("tr", {},
      e("th", { scope: "row" }, title),
      e("td", { class: "planned", "data-word": "planned" }, counts.planned), e("td", { class: "sign" }, "="),
      names.map((name, i) => e("td", { class: empty(name), "data-word": rayproof.word(name) },
        i ? e("span", { class: "sign", "aria-hidden": "true" }, "+") : null,
        title === "cases" && counts[name]
          ? e("button", { class: `count ${rayproof.tone(name)}`, onclick: () => onpick(name), title: `show these cases` },
            counts[name])
          : e("span", { class: `count ${counts[name] ? rayproof.tone(name) : "zero"}` }, counts[name]))));
    return e("section", { class: "panel scroll", "aria-label": "Totals" },
      e("table", { class: "ledger" },
        e("thead", {}, e("tr", {}, e("td"), e("th", { scope: "col" }, "planned"), e("td"),
          names.map((name) => e("th", { scope: "col" },
            e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(name)), " ", rayproof.word(name))))),
        e("tbody", {}, row("cases", results.summary), row("checks", results.checks))),
      e("p", { class: "muted" }, ["cases", "checks"].map((what, i) => {
        const counts = i ? results.checks : results.summary;
        const measured = ["pass", "warn", "fail", "reference_suspect"].reduce((sum, name) => sum + counts[name], 0);
        const failed = counts.error + counts.missing;
        return `${i ? "; " : ""}${counts.planned} ${counts.planned === 1 ? what.slice(0, -1) : what} planned = ${measured} measured + ${counts.undecided ? `${counts.undecided} undecided + ` : ""}${counts.unsupported} unsupported + ${failed} error${failed === 1 ? "" : "s"}`;
      }), "."),
      rayproof.examined(results.examined?.counts, results.examined?.words),
      (results.no_say || []).length ? e("ul", { class: "no-say" }, results.no_say.map((text) => e("li", {}, rayproof.pill("undecided"), " ", text))) : null);
  };

  // What became of every pixel of every check: a bar of their shares, and each kind with its number.
  rayproof.examined = function (counts, words) {
    if (!counts || !words || !(counts.pixels > 0)) return null;
    const kinds = Object.keys(words).filter((kind) => counts[kind] > 0 || kind === "unexamined");
    const bar = e("div", { class: "shares", "aria-hidden": "true" }, kinds.map((kind) => {
      const part = e("i", { class: `k-${kind}` });
      part.style.flexGrow = String(counts[kind]);
      return part;
    }));
    return e("div", { class: "examined" },
      e("p", {}, e("strong", {}, counts.pixels.toLocaleString("en")), " pixels over all checks, and what became of them [% of these pixels]"),
      bar, e("div", { class: "axis", "aria-hidden": "true" }, ["0 %", "50 %", "100 %"].map((text) => e("span", {}, text))),
      e("ul", { class: "kinds" }, kinds.map((kind) => e("li", { class: counts[kind] ? "" : "muted" },
        e("i", { class: `swatch k-${kind}`, "aria-hidden": "true" }), e("b", {}, counts[kind].toLocaleString("en")), " ", words[kind]))));
  };

  // Factors that a whole run shares: pi, 4, all fluxes.
  rayproof.commonFactors = function (results) {
    const rows = results.common_factors || [];
    if (!rows.length) return null;
    const wrong = rows.filter((row) => row.verdict === "fail").length;
    return e("details", { class: "panel", open: wrong > 0 },
      e("summary", {}, `Factors that the whole run shares (${wrong ? `${wrong} wrong` : "none wrong"})`),
      e("p", { class: "muted" }, "A wrong pi, 4 or flux multiplies every case alike; rounding does not. Ours over the oracle's, less 1, and the least that shows."),
      rayproof.scroll("table of common factors", e("table", {},
        e("thead", {}, e("tr", {}, ["verdict", "configuration", "stage", "off by", "limit", "cases", "cameras and lights"].map((title) => e("th", { scope: "col" }, title)))),
        e("tbody", {}, rows.map((row) => e("tr", {}, e("td", {}, rayproof.pill(row.verdict)), e("td", {}, row.configuration), e("td", {}, row.stage),
          e("td", { class: "figure" }, rayproof.short(row.off, 3)), e("td", { class: "figure" }, row.sees === null ? "too few" : rayproof.short(row.sees, 3)),
          e("td", { class: "figure" }, row.cases), e("td", { class: "figure" }, row.voices)))))));
  };

  // Why a case failed; of a long run once its row is there.
  function reason(row, others) {
    const node = e("bdi", { class: "muted" });
    const show = () => row.reason && rayproof.replace(node, ` \u2013 ${others ? `${row.name}: ` : ""}`, rayproof.prose(row.reason));
    const waiting = rayproof.complete(row);
    if (waiting) waiting.then(show, () => {});
    else show();
    return node;
  }

  // One row a cause, or for what is blamed where no cause is known, with its cases below.
  rayproof.bad = (row) => !["pass", "warn", "undecided", "unsupported"].includes(row.verdict);

  rayproof.blamed = function (results) {
    const bad = results.cases.filter(rayproof.bad);
    if (!bad.length) return null;
    const groups = new Map();
    for (const row of bad) {
      const key = `${row.verdict} ${row.cause || row.blame}`;
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(row);
    }
    const causes = results.causes || [];
    const told = new Set(bad.map((row) => row.cause));
    const shown = [...groups.values()].slice(0, 8);
    const left = bad.length - shown.reduce((sum, rows) => sum + rows.length, 0);
    return e("section", { class: "panel blamed", "aria-label": "What is blamed" },
      e("h2", {}, causes.length ? "What is wrong" : "What is blamed"),
      causes.filter((text) => !told.has(text)).map((text) => e("p", { class: "cause" }, e("strong", {}, e("bdi", {}, text)))),
      e("ul", {}, shown.map(([row, ...rest]) => e("li", {}, rayproof.pill(row.verdict), " ",
        row.cause || row.blame ? e("strong", {}, e("bdi", {}, (row.cause || row.blame).replace(/\.$/, ""))) : e("span", { class: "muted" }, "no stage"), " in ",
        [row, ...rest].slice(0, 8).flatMap((one, place) => [place ? ", " : "", e("a", { href: rayproof.link({ case: one.name, stage: one.stage }) }, e("bdi", {}, one.name))]),
        rest.length > 7 ? ` and ${rest.length - 7} more` : "",
        reason(row, rest.length)))),
      left ? e("p", { class: "muted" }, `and ${left} more in the list below`) : null);
  };

  // What differs, to be seen at once: the worst case's images, then those of others, by what is wrong with them.
  rayproof.differences = function (results) {
    const rows = results.cases.filter((row) => row.thumbnail && (!results.alone || rayproof.inlined(row.thumbnail)));
    if (!rows.length) return null;
    const [first] = rows;
    const groups = new Map();
    for (const row of rows) {
      const key = row.cause || row.blame || row.verdict;
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(row);
    }
    const open = (row, ...content) => e("a", { href: rayproof.link({ case: row.name, stage: row.stage }) }, content);
    const words = (row) => `${row.name}: ours, the reference and the error${row.stage ? ` at ${row.stage}` : ""}`;
    const picture = (row, name) => e("img", { class: name, src: rayproof.source(row.thumbnail), alt: words(row) });
    return e("section", { class: "panel differences", "aria-label": "What differs" }, e("h2", {}, "What differs"),
      e("figure", {}, open(first, picture(first, "worst")), e("figcaption", {}, "The worst: ", open(first, e("bdi", {}, first.name)),
        e("span", { class: "muted" }, ` \u2013 ours, the reference and the error${first.stage ? ` at ${first.stage}` : ""}`))),
      rows.length > 1 ? [...groups].map(([cause, members]) => e("div", {}, e("h3", {}, e("bdi", {}, cause)),
        e("div", { class: "thumbnails" }, members.map((row) => open(row, picture(row, "small"), e("bdi", {}, row.name)))))) : null);
  };

  rayproof.review = function (results) {
    if (!results.review.length) return null;
    return e("details", { class: "panel" },
      e("summary", {}, `Limits for review (${results.review.length})`),
      e("p", { class: "muted" }, "An error below a hundredth of its limit says the limit is loose; above 0.8, that it is tight."),
      rayproof.scroll("table of limits", e("table", {},
        e("thead", {}, e("tr", {}, e("th", {}, "check"), e("th", { "data-name": "error / limit" }, rayproof.ratioHead("error / limit")), e("th", {}, "why"))),
        e("tbody", {}, results.review.slice(0, 400).map((entry) => e("tr", {}, e("td", {}, entry.check),
          e("td", {}, rayproof.ratioBar(entry.ratio)), e("td", {}, rayproof.prose(entry.why))))))),
      results.review.length > 400 ? e("p", { class: "muted" }, "The rest is in results.json.") : null);
  };

  rayproof.slowest = function (results) {
    const rows = results.cases.filter((row) => row.seconds > 0).sort((a, b) => b.seconds - a.seconds).slice(0, 10);
    if (!rows.length) return null;
    const most = rows[0].seconds;
    const bar = (share) => {
      const fill = e("i", {});
      fill.style.width = `${100 * share}%`;
      return e("span", { class: "bar plain" }, fill);
    };
    const times = Object.entries(results.times || {}).sort((a, b) => b[1] - a[1]);
    return e("details", { class: "panel" }, e("summary", {}, "What was slow"), e("div", { class: "columns" },
      e("div", {}, e("h3", {}, "Cases, time [s]"), e("table", {}, e("tbody", {}, rows.map((row) => e("tr", {},
        e("td", {}, e("a", { href: rayproof.link({ case: row.name }) }, e("bdi", {}, row.name))),
        e("td", {}, bar(row.seconds / most)), e("td", { class: "figure" }, rayproof.seconds(row.seconds))))))),
      times.length ? e("div", {}, e("h3", {}, "Renderers, time of what was not in the cache, over all cases [s]"), e("table", {}, e("tbody", {}, times.map(([name, seconds]) => e("tr", {},
        e("td", {}, name), e("td", {}, bar(seconds / times[0][1])), e("td", { class: "figure" }, rayproof.seconds(seconds))))))) : null));
  };

  // Work-precision diagrams, where `rayproof tradeoff` left some in this folder.
  rayproof.tradeoff = function (results) {
    const names = results.tradeoff || [];
    if (!names.length) return null;
    const title = (name) => name.replace(/\.svg$/, "").replace("-", ": ");
    const shown = names.filter((name) => name.endsWith("-overall.svg"));
    return e("details", { class: "panel" },
      e("summary", {}, `Error against run time (${names.length} diagrams)`),
      e("p", {}, e("a", { href: "tradeoff/index.html" }, "All diagrams and their numbers")),
      e("div", { class: "scene" }, (shown.length ? shown : names.slice(0, 4)).map((name) => e("img",
        { src: `tradeoff/${name}`, alt: `error over run time, ${title(name)}`, loading: "lazy" }))));
  };

  rayproof.environment = function (results) {
    const references = Object.entries(results.references || {}).map(([name, about]) =>
      [name, [about.version, about.precision, about.independent ? "independent of the tracer" : "not independent"]
        .filter(Boolean).join(", ")]);
    const pairs = [["rayproof", results.rayproof], ...Object.entries(results.environment || {}), ...references,
      ["configurations", (results.configurations || []).join(", ")]];
    return e("details", { class: "panel" }, e("summary", {}, "Environment and references"),
      e("dl", { class: "facts" }, pairs.map(([name, value]) => [e("dt", {}, name), e("dd", {}, text(value))])));
  };

  const text = (value) => (value !== null && typeof value === "object" ? JSON.stringify(value) : String(value ?? ""));

  // Coverage by specification id: how many cases, the worst error against its limit, which references.
  function state(item, blamed) {
    if (!item.cases) return "missing";
    if (blamed.has(item.id)) return blamed.get(item.id);
    if (item.failed) return "undecided"; // a case that exercises it fails, and the blame lies elsewhere
    // Nothing of ours failed, and still something lies beyond its limit: then a reference does.
    return rayproof.number(item.worst_ratio) <= 1 ? "pass" : "reference_suspect";
  }

  // What every item was held against is said once; a row names its own only where they are others.
  function asked(names, everyone) {
    const missing = everyone.filter((name) => !names.includes(name));
    if (names.some((name) => !everyone.includes(name)) || missing.length * 2 > everyone.length) return names.join(", ");
    return missing.length ? `all but ${missing.join(", ")}` : "all";
  }
  const usual = (items) => items.map((item) => item.references || []).sort((a, b) => b.length - a.length)[0] || [];

  const STATES = { undecided: "cases fail, the blame lies elsewhere", missing: "not covered" };
  const says = (item, blamed) => STATES[state(item, blamed)] || rayproof.word(state(item, blamed));

  const table = (items, onpick, everyone, blamed) => (items.length ? rayproof.scroll("table of specification ids", e("table", { class: "coverage" },
    e("thead", {}, e("tr", {}, ["id", "", "what", "cases", "failed", "worst error / limit", "references"]
      .map((title) => (title ? e("th", { scope: "col", "data-name": title }, title.includes("/") ? rayproof.ratioHead(title) : title) : e("td"))))),
    e("tbody", {}, items.map((item) => e("tr", {},
      e("th", { scope: "row" }, e("button", { class: "link", onclick: () => onpick(item.id), title: "show its cases" }, item.id)),
      e("td", {}, e("span", { class: `glyph mark ${rayproof.tone(state(item, blamed))}`, role: "img", "aria-label": says(item, blamed), title: says(item, blamed) },
        rayproof.glyph(state(item, blamed)))),
      e("td", { class: "what" }, item.what),
      e("td", { class: "figure" }, item.cases),
      e("td", { class: "figure" }, item.failed ?? ""),
      e("td", {}, e("span", { title: item.worst_check || "" }, rayproof.ratioBar(item.cases ? item.worst_ratio : null, { blamed: !item.failed || blamed.has(item.id) }))),
      e("td", { class: "references" }, item.cases ? asked(item.references || [], everyone) : "")))))) : null);

  rayproof.coverage = function (results, onpick) {
    const everyone = usual(results.coverage);
    const covered = results.coverage.filter((item) => item.cases).length;
    // The ids that the failing cases' own blame names; others of these cases only lie downstream.
    const named = (row) => (String(row.blame || "").match(/[A-Z]+-\d+/g) || []).map((id) => [id, row.verdict]);
    const blamed = new Map(["reference_suspect", "fail"].flatMap((verdict) => results.cases.filter((row) => row.verdict === verdict).flatMap(named)));
    return e("section", { class: "panel", "aria-label": "Coverage" },
      e("h2", {}, "Coverage by specification id ",
        e("span", { class: "muted" }, `${covered} of ${results.coverage.length} covered`)),
      e("div", { class: "halves" }, [0, 1].map((half) => table(results.coverage.filter((_, i) => (i < results.coverage.length / 2) === (half === 0)), onpick, everyone, blamed))),
      e("p", { class: "muted legend" }, `all: ${everyone.join(", ") || "nobody"}`, ". ", rayproof.glyph("fail"), " blamed  ", rayproof.glyph("undecided"), ` ${STATES.undecided}  `, rayproof.glyph("missing"), ` ${STATES.missing}`));
  };
})(window.rayproof);
