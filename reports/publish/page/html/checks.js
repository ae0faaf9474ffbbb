// The numbers of one stage: each check with its metrics, its limit and how the limit was derived.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const SHOWN = ["worst_ratio", "worst_error", "limit", "pixel"];
  const FIRST = ["ulp", "interior", "edge", "differ_at_edge", "hit_miss", "nan", "inf"];

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

  function counts(measurement) {
    if (!measurement) return "";
    const bad = ["hit_miss", "nan", "inf", "wrong_at_edge"].filter((key) => measurement[key] > 0)
      .map((key) => `${measurement[key]} ${key.replaceAll("_", " ")}`);
    return [`${measurement.interior ?? "?"} interior`, `${measurement.edge ?? "?"} edge`, ...bad].join(", ");
  }

  // Of each pixel what became of it; the camera's are entries. Older records tell interior and edge only.
  function examined(check) {
    const words = rayproof.words || {};
    const ledger = check.examined;
    if (!ledger) return counts(check.end_to_end);
    const parts = Object.keys(words).filter((kind) => ledger[kind] > 0).map((kind) => `${ledger[kind]} ${words[kind]}`);
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

  function row(check, selected, onpixel) {
    const end = check.end_to_end || {};
    const pixel = Array.isArray(end.pixel) ? end.pixel : null;
    const details = e("tr", { class: "derivation", hidden: true }, e("td", { colspan: 9 },
      check.reason ? e("p", {}, e("strong", {}, "Why: "), check.reason) : null,
      check.because ? e("p", {}, e("strong", {}, "Limit: "), check.because) : null,
      e("div", { class: "columns" }, facts("End to end", check.end_to_end),
        facts("Given our own previous stages", check.continued),
        factors("Factors that pixels share", check.bias), factors("The same given our own previous stages", check.bias?.continued))));
    const toggle = e("button", { class: "quiet", "aria-expanded": "false", onclick: () => {
      details.hidden = !details.hidden;
      toggle.setAttribute("aria-expanded", String(!details.hidden));
    } }, "limit & metrics");
    return [e("tr", { class: selected ? "current" : "" },
      e("td", {}, rayproof.pill(check.verdict)),
      e("td", {}, check.configuration), e("td", {}, check.reference),
      e("td", {}, rayproof.ratioBar(overall(check))),
      e("td", {}, check.continued ? rayproof.ratioBar(check.continued.worst_ratio) : e("span", { class: "muted" }, "\u2013")),
      e("td", { class: "figure" }, rayproof.short(end.worst_error), e("span", { class: "muted" }, ` \u2264 ${rayproof.short(end.limit) || "?"}`)),
      e("td", {}, pixel ? e("button", { class: "link", onclick: () => onpixel(...pixel) }, pixel.join(", ")) : ""),
      e("td", { class: "pixels" }, examined(check)),
      e("td", {}, toggle)), details];
  }

  rayproof.checkTable = function (checks, { configuration, reference, unit, onpixel }) {
    if (!checks.length) return e("p", { class: "muted" }, "Nothing was checked at this stage.");
    return rayproof.scroll("table of checks", e("table", { class: "checks" },
      e("thead", {}, e("tr", {}, ["verdict", "configuration", "reference", "end to end", "given our previous stage", unit ? `worst error [${unit}]` : "worst error",
        "worst pixel", "pixels", ""].map((title) => (title ? e("th", { scope: "col" }, title) : e("td"))))),
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
          e("td", {}, item.because)))))));
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
        return e("li", {}, rayproof.pill("unsupported"), " ", e("strong", {}, reference), " ",
          e("span", { class: "muted" }, stages.filter(Boolean).join(", ")), ` \u2013 ${why}`);
      })));
  };

  rayproof.renders = function (data) {
    const rows = (data.renders || []).map((render) => e("li", {}, e("strong", {}, render.renderer), " ", rayproof.seconds(render.seconds),
      render.error ? [" ", rayproof.pill("error"), ` ${render.error}`] : null,
      render.image ? [" ", e("span", { class: "muted" }, render.image)] : null));
    const notes = (data.notes || []).map((note) => e("li", {}, note));
    // The page is beside the folder that it links, unless it is one file.
    const call = data.call && !document.querySelector("script[data-path]") ? e("p", {}, "The program's ",
      e("a", { href: data.call.split("/").map(encodeURIComponent).join("/") }, "call"), ": command, exit code and standard error; scene and meshes lie beside it. ",
      data.reproduce ? ["Make it again: ", e("code", {}, String(data.reproduce).replace(/^rayproof run /, "rayproof call "))] : null) : null;
    return rows.length || notes.length ? e("details", { class: "panel" },
      e("summary", {}, `Renders (${rows.length})`), call, e("ul", {}, rows, notes)) : null;
  };
})(window.rayproof);
