// Coverage by specification id: how many cases, the worst error against its limit, which references.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  function state(item) {
    if (!item.cases) return "missing";
    if (item.failed) return "fail";
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

  const table = (items, onpick, everyone) => (items.length ? rayproof.scroll("table of specification ids", e("table", { class: "coverage" },
    e("thead", {}, e("tr", {}, ["id", "", "what", "cases", "failed", "worst error / limit", "references"]
      .map((title) => (title ? e("th", { scope: "col" }, title) : e("td"))))),
    e("tbody", {}, items.map((item) => e("tr", {},
      e("th", { scope: "row" }, e("button", { class: "link", onclick: () => onpick(item.id), title: "show its cases" }, item.id)),
      e("td", {}, e("span", { class: `glyph mark ${rayproof.tone(state(item))}`, role: "img", "aria-label": rayproof.word(state(item)), title: rayproof.word(state(item)) },
        rayproof.glyph(state(item)))),
      e("td", { class: "what" }, item.what),
      e("td", { class: "figure" }, item.cases),
      e("td", { class: "figure" }, item.failed ?? ""),
      e("td", {}, e("span", { title: item.worst_check || "" }, rayproof.ratioBar(item.cases ? item.worst_ratio : null))),
      e("td", { class: "references" }, item.cases ? asked(item.references || [], everyone) : "")))))) : null);

  rayproof.coverage = function (results, onpick) {
    const everyone = usual(results.coverage);
    const covered = results.coverage.filter((item) => item.cases).length;
    return e("section", { class: "panel", "aria-label": "Coverage" },
      e("h2", {}, "Coverage by specification id ",
        e("span", { class: "muted" }, `${covered} of ${results.coverage.length} covered`)),
      e("div", { class: "halves" }, [0, 1].map((half) => table(results.coverage.filter((_, i) => (i < results.coverage.length / 2) === (half === 0)), onpick, everyone))),
      e("p", { class: "muted legend" }, `all: ${everyone.join(", ") || "nobody"}`));
  };
})(window.rayproof);
