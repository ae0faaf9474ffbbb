// Two runs side by side: what changed on the front page, worst first, and every check before and after on a case's.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
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

  function row(results, item) {
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
      rayproof.append(body, part.map((item) => row(results, item)));
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
})(window.rayproof);
