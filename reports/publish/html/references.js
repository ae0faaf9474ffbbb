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
        notes.map(([note, count]) => e("p", { class: "muted" }, e("bdi", {}, note), count > 1 ? ` (${count} cases, with numbers of their own)` : "")),
        unsupported.length ? e("details", {}, e("summary", {}, `cannot answer (${unsupported.length})`), e("ul", {}, unsupported.map(([why, count]) =>
          e("li", {}, e("bdi", {}, why), e("span", { class: "muted" }, ` ${count} stage${count === 1 ? "" : "s"} of cases`))))) : null];
    };
    return e("section", { class: "panel", "aria-label": "References" }, e("h1", {}, "References"),
      e("div", { class: "scroll" }, e("table", { class: "panelists" },
        e("thead", {}, e("tr", {}, ["reference", "version", "precision", "shares with the tracer", "settings, epsilons, other questions"].map(th))),
        e("tbody", {}, rows.map(([name, about]) => e("tr", {}, e("th", { scope: "row" }, name), e("td", {}, about.version || ""), e("td", {}, about.precision || ""),
          e("td", {}, about.independent ? "nothing" : "code or compiler: no witness"), e("td", {}, facts(name))))))),
      Object.entries(results.absent || {}).map(([name, why]) => e("p", {}, rayproof.pill("missing"), " ", e("strong", {}, name), ` ${why}`)));
  }

  function findings(list) {
    const keys = [["reference", "reference"], ["version", "version"], ["stage", "stage"], ["cases", "cases"], ["smallest_scene", "smallest scene"],
      ["third_witness", "third witness"], ["what", "what"]];
    return e("section", { class: "panel", "aria-label": "Findings" }, e("h2", {}, "Findings about references"),
      list.length ? e("div", { class: "scroll" }, e("table", {}, e("thead", {}, e("tr", {}, keys.map(([, title]) => th(title)))),
        e("tbody", {}, list.map((finding) => e("tr", {}, keys.map(([key]) => e("td", {}, key === "smallest_scene" && finding[key]
          ? e("a", { href: rayproof.link({ case: finding[key], stage: finding.stage }) }, e("bdi", {}, finding[key])) : e("bdi", {}, text(finding[key])))))))))
        : e("p", { class: "muted" }, "None: no reference was found wrong on a case of this run. Only a finding turns \u201Creference suspect\u201D into a warning."));
  }

  function environment(results) {
    const pairs = [["rayproof", results.rayproof], ["command", results.command], ["started", results.started], ["under test", results.subject],
      ["configurations", (results.configurations || []).join(", ")], ...Object.entries(results.environment || {})];
    return e("section", { class: "panel", "aria-label": "Environment" }, e("h2", {}, "Environment"),
      e("dl", { class: "facts" }, pairs.filter(([, value]) => value !== null && value !== undefined && value !== "").map(([name, value]) =>
        [e("dt", {}, name.replaceAll("_", " ")), e("dd", {}, text(value))])));
  }

  rayproof.addPage("references", { title: "References", has: (results) => Object.keys(results.references || {}).length > 0,
    view: (results) => e("div", {}, panel(results), findings(results.findings || []), environment(results)) });
})(window.rayproof);
