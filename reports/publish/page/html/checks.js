// Who was asked: versions, precision, settings and findings of the references, and the machine that all of it ran on.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const th = (title) => e("th", { scope: "col" }, title);
  const text = (value) => (value !== null && typeof value === "object" ? JSON.stringify(value) : String(value ?? ""));

  function panel(results) {
    const rows = Object.entries(results.references || {});
    const said = (name) => results.panel?.[name] || {};
    const facts = (name) => {
      const { settings = {}, notes = [], unsupported = [] } = said(name);
      const own = Object.entries(settings);
      return [
        own.length ? e("dl", { class: "facts dense" }, own.map(([key, values]) => [e("dt", {}, key.replaceAll("_", " ")), e("dd", {}, values.join(" or "))])) : null,
        notes.map(([note, count]) => e("p", { class: "muted" }, e("bdi", {}, rayproof.prose(note)), count > 1 ? ` (${count} cases, with numbers of their own)` : "")),
        unsupported.length ? e("details", {}, e("summary", {}, `cannot answer (${unsupported.length})`), e("ul", {}, unsupported.map(([why, count]) =>
          e("li", {}, e("bdi", {}, rayproof.prose(why)), e("span", { class: "muted" }, ` ${count} stage${count === 1 ? "" : "s"} of cases`))))) : null];
    };
    return e("section", { class: "panel", "aria-label": "References" }, e("h1", {}, "References"),
      rayproof.scroll("table of references", e("table", { class: "panelists" },
        e("thead", {}, e("tr", {}, ["reference", "version", "precision", "shares with the tracer", "settings, epsilons, other questions"].map(th))),
        e("tbody", {}, rows.map(([name, about]) => e("tr", {}, e("th", { scope: "row" }, rayproof.reference(name)), e("td", {}, about.version || ""), e("td", {}, about.precision || ""),
          e("td", {}, about.independent ? "nothing" : "code or compiler: no witness"), e("td", {}, facts(name))))))),
      Object.entries(results.absent || {}).map(([name, why]) => e("p", {}, rayproof.pill("missing"), " ", e("strong", {}, name), " ", rayproof.prose(why))));
  }

  // One defect shows at several stages and in several cases: told once.
  function merged(list) {
    const groups = new Map();
    for (const finding of list) {
      const key = JSON.stringify([finding.reference, finding.version, finding.what, finding.smallest_scene]);
      groups.set(key, [...(groups.get(key) || []), finding]);
    }
    return [...groups.values()].map((same) => ({ ...same[0],
      ...Object.fromEntries(["stage", "where", "third_witness"].map((name) => [name, [...new Set(same.map((one) => (name === "where" ? where(one) : one[name])).filter(Boolean))]])) }));
  }

  // Under which circumstances of a scene it shows.
  const where = (finding) => `${String(finding.where).replaceAll("_", " ")} \u2265 ${rayproof.short(finding.at_least)}`;

  // The smallest scene is a case of the run, or a file that any checkout has.
  function smallest(results, finding) {
    const name = text(finding.smallest_scene);
    if (results.cases.some((row) => row.name === name)) return e("a", { href: rayproof.link({ case: name, stage: finding.stage[0] }) }, e("bdi", {}, name));
    return name ? rayproof.code(`rayproof run ${rayproof.quoted(name)}`) : "";
  }

  function findings(results) {
    const list = merged(results.findings || []);
    const lines = (values, between) => e("bdi", {}, rayproof.prose(values.map(text).join(between)));
    return e("section", { class: "panel", "aria-label": "Findings" }, e("h2", {}, "Findings about references"),
      list.length ? rayproof.scroll("table of findings", e("table", { class: "findings" },
        e("thead", {}, e("tr", {}, ["reference", "what", "stages", "where", "smallest scene", "third witness"].map(th))),
        e("tbody", {}, list.map((finding) => e("tr", {}, e("th", { scope: "row" }, rayproof.reference(text(finding.reference)), e("div", { class: "muted" }, text(finding.version))),
          e("td", {}, e("bdi", {}, rayproof.prose(text(finding.what)))), e("td", {}, lines(finding.stage, ", ")), e("td", {}, lines(finding.where, ", ")),
          e("td", {}, smallest(results, finding)), e("td", {}, lines(finding.third_witness, "; ")))))))
        : e("p", { class: "muted" }, "None: no reference was found wrong. Only a finding turns \u201Creference suspect\u201D into a warning."));
  }

  function environment(results) {
    const pairs = [["rayproof", results.rayproof], ["command", results.command], ["started", results.started], ["under test", results.subject],
      ["configurations", (results.configurations || []).join(", ")], ...Object.entries(results.environment || {})];
    return e("section", { class: "panel", "aria-label": "Environment" }, e("h2", {}, "Environment"),
      e("dl", { class: "facts" }, pairs.filter(([, value]) => value !== null && value !== undefined && value !== "").map(([name, value]) =>
        [e("dt", {}, name.replaceAll("_", " ")), e("dd", {}, text(value))])));
  }

  rayproof.addPage("references", { title: "References", has: (results) => Object.keys(results.references || {}).length > 0,
    view: (results) => e("div", {}, panel(results), findings(results), environment(results)) });

  // The numbers of one stage: each check with its metrics, its limit and how the limit was derived.
  const SHOWN = ["worst_ratio", "worst_error", "limit", "pixel"];
  const FIRST = ["wrong", "explained", "ulp", "interior", "hit_miss", "nan", "inf"];

  const list = (value) => (Array.isArray(value) ? value.map((item) => rayproof.short(item, 6)).join(", ")
    : value !== null && typeof value === "object" ? JSON.stringify(value)
    : rayproof.number(value) === null ? String(value) : rayproof.short(value, 4));

  function facts(title, measurement) {
    if (!measurement) return null;
    const keys = [...FIRST, ...Object.keys(measurement).filter((key) => !FIRST.includes(key) && !SHOWN.includes(key))];
    const pairs = keys.filter((key) => measurement[key] !== null && measurement[key] !== undefined);
    return e("div", {}, e("h4", {}, title), e("dl", { class: "facts dense" },
      pairs.map((key) => [e("dt", {}, key.replaceAll("_", " ")), e("dd", {}, list(measurement[key]))])));
  }

  // Whose pixels are wrong: those of the reference that is under suspicion or known to be wrong there, else the subject's.
  rayproof.whose = (check) => (check.finding || check.verdict === "reference_suspect" ? rayproof.reference(check.reference) : check.configuration);

  // What decides a check: the numbers of wrong pixels, and the pixel whose error is the largest in units of its own limit.
  rayproof.decides = function (check, stage, onpixel) {
    if (!check || check.verdict === "unsupported") return null;
    const unit = stage.unit && stage.unit !== "1" ? ` ${stage.unit}` : "";
    const { wrong = 0, pixels = 0 } = check.examined || {};
    const at = rayproof.worstOf(check);
    const count = wrong ? `${wrong.toLocaleString("en")} of ${pixels.toLocaleString("en")} pixels are wrong, those of ${rayproof.whose(check)}.` : "No pixel is wrong.";
    return [e("strong", {}, "What decides: "), count, at ? [" The ", rayproof.term("worst pixel"), " is ", e("button", { class: "link", onclick: () => onpixel(...at.pixel) }, at.pixel.join(", ")),
      `: off by ${rayproof.short(at.worst_error)}${unit}, its limit is ${rayproof.short(at.limit) || "?"}${unit}`, " (", rayproof.term("error / limit"), ` ${rayproof.ratio(at.worst_ratio)}).`] : ""];
  };

  // Of each pixel what became of it; the camera's are entries.
  function examined(check) {
    const words = rayproof.words || {};
    const ledger = check.examined;
    if (!ledger) return "";
    const parts = Object.keys(words).filter((kind) => ledger[kind] > 0).map((kind) => `${ledger[kind]} ${words[kind]}${kind === "wrong" ? ` (${rayproof.whose(check)})` : ""}`);
    const bad = ["hit_miss", "nan", "inf"].filter((key) => check.end_to_end?.[key] > 0).map((key) => `${check.end_to_end[key]} ${key.replaceAll("_", " ")}`);
    return [...parts, ...bad].join(", ");
  }

  // The factors that groups of pixels share, the one that uses most of its limit first.
  function factors(title, bias) {
    if (!bias) return null;
    const groups = (Array.isArray(bias.groups) ? bias.groups : []).filter((group) => ["off", "sees", "lights"].every((key) => Array.isArray(group?.[key])));
    const rows = groups.flatMap((group) => group.off.map((off, i) => ({ ...group, off, sees: group.sees[i], channel: "RGB"[i] })))
      .filter((row) => row.off !== null).sort((a, b) => Math.abs(b.off) / b.sees - Math.abs(a.off) / a.sees);
    return e("div", {}, e("h4", {}, title), e("p", { class: "muted" }, `Uses ${rayproof.short(bias.ratio, 3)} of its limit; sees factors from 1 \u00B1 ${rayproof.short(bias.sees, 3)} on.`),
      rows.length ? e("table", {},
        e("thead", {}, e("tr", {}, ["shape", "lights", "channel", "pixels", "off by", "limit"].map((name) => e("th", { scope: "col" }, name)))),
        e("tbody", {}, rows.slice(0, 12).map((row) => e("tr", {}, e("td", {}, row.shape),
          e("td", {}, row.fitted === undefined ? row.lights.join(", ") : `${row.fitted} of ${row.lights.join(", ")}`), e("td", {}, row.channel),
          e("td", { class: "figure" }, row.pixels), e("td", { class: "figure" }, rayproof.short(row.off, 3)), e("td", { class: "figure" }, rayproof.short(row.sees, 3)))))) : null,
      rows.length > 12 ? e("p", { class: "muted" }, `and ${rows.length - 12} more in results.json`) : null);
  }

  // Where nothing was measured the record has the ratio 0; of the camera nothing else is recorded.
  const UNMEASURED = ["error", "missing", "undecided", "unsupported"];
  const overall = (check) => check.end_to_end?.worst_ratio ?? (UNMEASURED.includes(check.verdict) ? null : check.ratio);

  // A check's worst pixel is where its error over its limit is the largest, end to end or continued: -> that measurement.
  const rank = ({ worst_ratio: ratio }) => { const value = rayproof.number(ratio); return Number.isNaN(value) ? Infinity : value; };
  rayproof.worstOf = (check) => [check?.end_to_end, check?.continued].filter((one) => Array.isArray(one?.pixel) && rank(one) > 0).sort((a, b) => rank(b) - rank(a))[0];

  function row(check, selected, onpixel) {
    const end = rayproof.worstOf(check) || check.end_to_end || {};
    const pixel = rayproof.worstOf(check)?.pixel;
    const details = e("tr", { class: "derivation", hidden: true }, e("td", { colspan: 9 },
      check.reason ? e("p", {}, e("strong", {}, "Why: "), rayproof.prose(check.reason)) : null,
      check.because ? e("p", {}, e("strong", {}, "Limit: "), rayproof.prose(check.because)) : null,
      e("div", { class: "columns" }, facts("End to end", check.end_to_end),
        facts("Continued from our own previous stages", check.continued),
        factors("Factors that pixels share", check.bias), factors("The same continued from our own previous stages", check.bias?.continued))));
    const toggle = e("button", { class: "quiet", "aria-expanded": "false", onclick: () => {
      details.hidden = !details.hidden;
      toggle.setAttribute("aria-expanded", String(!details.hidden));
    } }, "details");
    return [e("tr", { class: selected ? "current" : "" },
      e("td", {}, rayproof.pill(check.verdict)),
      e("td", { class: "name" }, rayproof.parts(check.configuration)), e("td", {}, rayproof.reference(check.reference)),
      e("td", {}, rayproof.ratioBar(overall(check))),
      e("td", {}, check.continued ? rayproof.ratioBar(check.continued.worst_ratio) : e("span", { class: "muted" }, "\u2013")),
      e("td", {}, pixel ? e("button", { class: "link", onclick: () => onpixel(...pixel) }, pixel.join(", ")) : ""),
      e("td", { class: "figure" }, rayproof.short(end.worst_error), e("span", { class: "muted" }, `, limit ${rayproof.short(end.limit) || "?"}`)),
      e("td", { class: "pixels" }, examined(check)),
      e("td", {}, toggle)), details];
  }

  // The words of a heading that have a definition.
  function heading(title) {
    const [word, more] = [title.split(",")[0], title.split(", ")[1]];
    if (word === "error / limit") return rayproof.ratioHead([rayproof.term(word), ", ", rayproof.term(more)]);
    return rayproof.term(title);
  }

  rayproof.checkTable = function (checks, { configuration, reference, unit, onpixel }) {
    if (!checks.length) return e("p", { class: "muted" }, "Nothing was checked at this stage.");
    return rayproof.scroll("table of checks", e("table", { class: "checks" },
      e("thead", {}, e("tr", {}, ["verdict", "configuration", "reference", "error / limit, end to end", "error / limit, continued", "worst pixel",
        unit ? `its error [${unit}] and limit` : "its error and limit", "what became of the pixels", ""].map((title) => (title ? e("th", { scope: "col", "data-name": title }, heading(title)) : e("td"))))),
      e("tbody", {}, checks.map((check) => row(check,
        check.configuration === configuration && check.reference === reference, onpixel)))));
  };

  rayproof.expectations = function (list) {
    if (!list.length) return null;
    return e("section", { class: "panel", "aria-label": "Closed forms" }, e("h3", {}, "Closed forms"),
      rayproof.scroll("table of closed forms", e("table", {},
        e("thead", {}, e("tr", {}, ["verdict", "configuration", "stage", "measured", "expected", "limit", "because"]
          .map((title) => e("th", { scope: "col" }, title)))),
        e("tbody", {}, list.map((item) => e("tr", {}, e("td", {}, rayproof.pill(item.verdict)),
          e("td", {}, item.configuration || ""), e("td", {}, item.stage || ""),
          ["measured", "expected", "limit"].map((key) => e("td", { class: "figure" }, rayproof.short(item[key], 7))),
          e("td", {}, rayproof.prose(item.because))))))));
  };

  rayproof.unsupported = function (list) {
    if (!list.length) return null;
    // One line per reference and reason: eight stages refused for one reason are one fact.
    const groups = new Map();
    for (const item of list) {
      const key = JSON.stringify([item.reference, item.why]);
      groups.set(key, [...(groups.get(key) || []), item.stage]);
    }
    return e("section", { class: "panel", "aria-label": "Unsupported" }, e("h3", {}, "Unsupported"),
      e("ul", {}, [...groups].map(([key, stages]) => {
        const [reference, why] = JSON.parse(key);
        return e("li", {}, rayproof.pill("unsupported"), " ", e("strong", {}, rayproof.reference(reference)), " ",
          e("span", { class: "muted" }, stages.filter(Boolean).join(", ")), " \u2013 ", rayproof.prose(why));
      })));
  };

  // What `rayproof shrink` left of the case, beside the page; not in one file.
  rayproof.small = function (data) {
    if (!data.small || document.querySelector("script[data-path]")) return null;
    const at = data.small.split("/").map(encodeURIComponent).join("/");
    const link = (file, text) => e("a", { href: `${at}/${file}` }, text);
    return e("details", { class: "panel", open: true }, e("summary", {}, "The smallest scene that fails alike"),
      e("p", {}, link("issue.md", "an issue to paste"), ", ", link("scene.json", "the scene"), ", ", link("pixel.md", "its pixel, stage by stage")),
      e("img", { src: `${at}/picture.png`, alt: "the failing stage, the renderer's left, the right one right" }));
  };

  // In the place of images that the run left out.
  rayproof.preview = function (data) {
    if (!data.preview) return null;
    return e("section", { class: "panel", "aria-label": "Preview" }, e("figure", {}, e("img", { class: "worst", src: rayproof.source(data.preview), alt: "ours, the reference and the error, small" }),
      e("figcaption", { class: "muted" }, "Ours, the reference and the error. The images themselves are made by ", rayproof.code(`${data.command} --keep-images all`))));
  };

  rayproof.renders = function (data) {
    const rows = (data.renders || []).map((render) => e("li", {}, e("strong", {}, rayproof.reference(render.renderer)), " ", render.cached ? "from the cache" : rayproof.seconds(render.seconds),
      render.error ? [" ", rayproof.pill("error"), " ", rayproof.prose(render.error)] : null,
      render.image ? [" ", e("span", { class: "muted" }, render.image)] : null));
    const notes = (data.notes || []).map((note) => e("li", {}, rayproof.prose(note)));
    const [probe, subject] = data.probe || ["", ""];
    const call = /--subject '?(exec|serve|python):/.test(subject) ? e("p", {},
      "Call the program once more, and keep its scene, command, output and image: ", rayproof.code(`${probe.replace(" probe ", " call ")} call${subject}`)) : null;
    return rows.length || notes.length ? e("details", { class: "panel" },
      e("summary", {}, `Renders (${rows.length})`), call, e("ul", {}, rows, notes)) : null;
  };

  // Everybody judged against everybody at one stage, and who stands alone.
  // panel: {baseline, renderers, ratio: rows judged by columns, differing, alone, why}
  rayproof.adjudication = function (panel) {
    if (!panel || !Array.isArray(panel.renderers) || panel.renderers.length < 2) return null;
    const { renderers } = panel, names = renderers.map(rayproof.reference);
    const alone = String(panel.alone ?? "").split(", ");
    // Who can be compared with nobody here has nothing to say.
    const heard = renderers.map((_, i) => i).filter((i) => renderers.some((_, j) => value(panel.ratio, i, j) !== null || value(panel.ratio, j, i) !== null));
    const cell = (i, j) => {
      if (i === j) return e("td", { class: "self", title: names[i] }, "\u2013");
      const ratio = value(panel.ratio, i, j);
      if (ratio === null) return e("td", { class: "muted", title: "cannot be compared" }, "\u00B7");
      const bad = !(ratio <= 1);
      const pixels = value(panel.differing, i, j);
      return e("td", { class: `figure ${rayproof.tone(bad ? "fail" : "pass")} ${bad ? "over" : ""}`,
        title: `${names[i]} against ${names[j]}: error / limit ${rayproof.ratio(ratio)}, ${pixels ?? "?"} pixels over it` },
      e("span", { class: "mark glyph" }, rayproof.glyph(bad ? "fail" : "pass")), " ", rayproof.ratio(ratio, 2), bad && pixels ? e("small", {}, ` ${pixels} px`) : null);
    };
    return e("section", { class: "adjudication", "aria-label": "Everybody against everybody" }, e("h3", {}, "Everybody against everybody"),
      panel.why ? e("p", {}, e("bdi", {}, rayproof.prose(panel.why))) : null,
      e("details", { open: panel.alone ? true : null }, e("summary", {}, `Largest error / limit, ${heard.length} renderers: row judged against column`),
        rayproof.wide("matrix of renderers", e("table", { class: "versus" },
          e("thead", {}, e("tr", {}, e("td"), heard.map((j) => e("th", { scope: "col" }, e("span", {}, names[j]))))),
          e("tbody", {}, heard.map((i) => e("tr", { class: alone.includes(renderers[i]) ? "alone" : "" },
            e("th", { scope: "row" }, rayproof.parts(names[i]), alone.includes(renderers[i]) ? " \u2190 alone" : ""), heard.map((j) => cell(i, j)))))))));
  };

  const value = (table, i, j) => rayproof.number(table?.[i]?.[j]);
})(window.rayproof);
