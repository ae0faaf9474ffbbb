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

  // The first screen: shouts, the verdict in one sentence, what is wrong; the totals once, and at the end the environment.
  rayproof.shoutBars = (results) => results.shouts.map((text) => e("p", { class: "shout", role: "alert" }, text));

  rayproof.verdictLine = function (results) {
    const verdict = String(results.verdict);
    return e("section", { class: `verdict ${rayproof.tone(verdict)}`, "aria-label": "Verdict" },
      e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(verdict)),
      e("div", {},
        e("h1", {}, results.headline),
        e("p", { class: "muted" }, [results.command, started(results.started), rayproof.seconds(results.seconds)]
          .filter(Boolean).flatMap((text, i) => (i ? [" \u00B7 ", text] : [rayproof.code(text)])))));
  };

  // What a reader of the headline must know beside it.
  rayproof.remarks = (results) => ((results.remarks || []).length
    ? e("ul", { class: "remarks", "aria-label": "Remarks" }, results.remarks.map((text) => e("li", {}, rayproof.prose(text)))) : null);

  const started = (text) => (text ? String(text).slice(0, 16).replace("T", " ") : "");

  // planned = pass + warn + ..., for cases and for checks, and what became of every pixel.
  rayproof.ledger = function (results, onpick) {
    const names = results.ledger.slice(1);
    // On a narrow screen numbers wrap, each with its word, and zeros are left out, so that what failed stays in sight.
    const empty = (name) => (results.summary[name] || results.checks[name] ? "" : "empty");
    const row = (title, counts) => e("tr", {},
      e("th", { scope: "row" }, rayproof.term(title.slice(0, -1), title)),
      e("td", { class: "planned", "data-word": "planned" }, counts.planned), e("td", { class: "sign" }, "="),
      names.map((name, i) => e("td", { class: empty(name), "data-word": rayproof.word(name) },
        i ? e("span", { class: "sign", "aria-hidden": "true" }, "+") : null,
        title === "cases" && counts[name]
          ? e("button", { class: `count ${rayproof.tone(name)}`, onclick: () => onpick(name), title: `show these cases` },
            counts[name])
          : e("span", { class: `count ${counts[name] ? rayproof.tone(name) : "zero"}` }, counts[name]))));
    return e("section", { class: "panel", "aria-label": "Totals" }, e("h2", {}, "Totals"),
      e("div", { class: "scroll" }, e("table", { class: "ledger" },
        e("thead", {}, e("tr", {}, e("td"), e("th", { scope: "col" }, "planned"), e("td"),
          names.map((name) => e("th", { scope: "col" },
            e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(name)), " ", rayproof.word(name))))),
        e("tbody", {}, row("cases", results.summary), row("checks", results.checks)))),
      rayproof.examined(results.examined?.counts, results.examined?.words));
  };

  // What became of every pixel of every check: a bar of their shares, and each kind with its number.
  rayproof.examined = function (counts, words) {
    if (!counts || !words || !(counts.pixels > 0)) return null;
    const kinds = Object.keys(words).filter((kind) => counts[kind] > 0 || kind === "unexamined");
    const count = (kind) => counts[kind] || 0;
    const bar = e("div", { class: "shares", "aria-hidden": "true" }, kinds.map((kind) => {
      const part = e("i", { class: `k-${kind}` });
      part.style.flexGrow = String(count(kind));
      return part;
    }));
    return e("div", { class: "examined" },
      e("p", {}, e("strong", {}, counts.pixels.toLocaleString("en")), " pixels over all checks, and what became of them [% of these pixels]"),
      bar, e("div", { class: "axis", "aria-hidden": "true" }, ["0 %", "50 %", "100 %"].map((text) => e("span", {}, text))),
      e("ul", { class: "kinds" }, kinds.map((kind) => e("li", { class: count(kind) ? "" : "muted" },
        e("i", { class: `swatch k-${kind}`, "aria-hidden": "true" }), e("b", {}, count(kind).toLocaleString("en")), " ", words[kind]))));
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

  rayproof.bad = (row) => !["pass", "warn", "undecided", "unsupported"].includes(row.verdict);

  const times = (count, noun) => `${count} ${noun}${count === 1 ? "" : "s"}`;

  // One row a cause, or for what is blamed where no cause is known: first what is new, then what is accepted, then mended.
  rayproof.blamed = function (results) {
    const { new: fresh, accepted, mended } = results.groups;
    const gated = accepted.length || mended.length || results.gate;
    const told = new Set([...fresh, ...accepted].map((group) => group.what));
    const open = (group, name) => e("a", { href: rayproof.link({ case: name, stage: group.stage }) }, e("bdi", {}, name));
    const line = (group) => e("li", {}, rayproof.pill(group.verdict), " ", e("strong", {}, times(group.count, "case"), group.what ? [": ", e("bdi", {}, group.what.replace(/\.$/, ""))] : null),
      e("div", {}, "in ", group.names.flatMap((name, place) => [place ? ", " : "", open(group, name)]),
        group.count > group.names.length ? ` and ${group.count - group.names.length} more` : ""),
      e("div", { class: "muted" }, e("bdi", {}, [group.count > 1 ? group.names[0] : null, group.wrong || null].filter(Boolean).join(": "), group.wrong ? ". " : " ", rayproof.prose(group.reason))));
    const list = (title, groups, name) => (groups.length ? [e("h3", { class: name }, `${title}: ${times(groups.reduce((sum, group) => sum + group.count, 0), "case")}`),
      e("ul", {}, groups.slice(0, 8).map(line)), groups.length > 8 ? e("p", { class: "muted" }, `and ${times(groups.length - 8, "more group")} in the list below`) : null] : null);
    const beside = (results.causes || []).filter((text) => !told.has(text));
    if (!fresh.length && !gated && !beside.length) return null;
    return e("section", { class: "panel blamed", "aria-label": "What is wrong" },
      e("h2", {}, gated ? "New, accepted and mended failures" : "What is wrong"),
      beside.map((text) => e("p", { class: "cause" }, e("strong", {}, e("bdi", {}, text)))),
      gated ? [list("New", fresh, "new"), list("Accepted", accepted, "accepted")] : e("ul", {}, fresh.slice(0, 8).map(line)),
      !gated && fresh.length > 8 ? e("p", { class: "muted" }, `and ${times(fresh.length - 8, "more group")} in the list below`) : null,
      mended.length ? [e("h3", { class: "mended" }, `Mended: ${mended.length}`), e("ul", {}, mended.slice(0, 8).map((text) => e("li", {}, rayproof.pill("pass"), " ", e("bdi", {}, text)))),
        mended.length > 8 ? e("p", { class: "muted" }, `and ${mended.length - 8} more in summary.md`) : null] : null,
      (results.shut || []).length ? [e("h3", {}, "What shuts the gate"), e("ul", {}, results.shut.map((text) => e("li", {}, rayproof.prose(text))))] : null);
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
        e("thead", {}, e("tr", {}, e("th", {}, rayproof.term("check")), e("th", { "data-name": "error / limit" }, rayproof.ratioHead(rayproof.term("error / limit"))), e("th", {}, "why"))),
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
      [rayproof.reference(name), [about.version, about.precision, about.independent ? "independent of the tracer" : "not independent"]
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
    if (names.some((name) => !everyone.includes(name)) || missing.length * 2 > everyone.length) return names.map(rayproof.reference).join(", ");
    return missing.length ? `all but ${missing.map(rayproof.reference).join(", ")}` : "all";
  }
  const usual = (items) => items.map((item) => item.references || []).sort((a, b) => b.length - a.length)[0] || [];

  const STATES = { undecided: "cases fail, the blame lies elsewhere", missing: "not covered" };
  const says = (item, blamed) => STATES[state(item, blamed)] || rayproof.word(state(item, blamed));

  const table = (items, onpick, everyone, blamed) => (items.length ? rayproof.scroll("table of specification ids", e("table", { class: "coverage" },
    e("thead", {}, e("tr", {}, ["id", "", "what", "cases", "failed", "worst error / limit", "references"]
      .map((title) => (title ? e("th", { scope: "col", "data-name": title }, title.includes("/") ? rayproof.ratioHead(["worst ", rayproof.term("error / limit")]) : title) : e("td"))))),
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
    // A phone's screen would be filled fifteen times before the list of cases begins.
    return e("details", { class: "panel", open: !rayproof.narrow(), role: "region", "aria-label": "Coverage" },
      e("summary", {}, "Coverage by specification id ",
        e("span", { class: "muted" }, `${covered} of ${results.coverage.length} covered`)),
      e("div", { class: "halves" }, [0, 1].map((half) => table(results.coverage.filter((_, i) => (i < results.coverage.length / 2) === (half === 0)), onpick, everyone, blamed))),
      e("p", { class: "muted legend" }, `all: ${everyone.map(rayproof.reference).join(", ") || "nobody"}`, ". ", rayproof.glyph("fail"), " blamed  ", rayproof.glyph("undecided"), ` ${STATES.undecided}  `, rayproof.glyph("missing"), ` ${STATES.missing}`));
  };
})(window.rayproof);
