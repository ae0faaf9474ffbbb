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
      rayproof.scroll("table of references", e("table", { class: "panelists" },
        e("thead", {}, e("tr", {}, ["reference", "version", "precision", "shares with the tracer", "settings, epsilons, other questions"].map(th))),
        e("tbody", {}, rows.map(([name, about]) => e("tr", {}, e("th", { scope: "row" }, name), e("td", {}, about.version || ""), e("td", {}, about.precision || ""),
          e("td", {}, about.independent ? "nothing" : "code or compiler: no witness"), e("td", {}, facts(name))))))),
      Object.entries(results.absent || {}).map(([name, why]) => e("p", {}, rayproof.pill("missing"), " ", e("strong", {}, name), ` ${why}`)));
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

  // Under which circumstances of a scene it shows; before there were any a finding named cases.
  const where = (one) => (one.where ? `${String(one.where).replaceAll("_", " ")} \u2265 ${rayproof.short(one.at_least)}` : one.cases);

  // The smallest scene is a case of the run, or a file that any checkout has.
  function smallest(results, finding) {
    const name = text(finding.smallest_scene);
    if (results.cases.some((row) => row.name === name)) return e("a", { href: rayproof.link({ case: name, stage: finding.stage[0] }) }, e("bdi", {}, name));
    return name ? e("code", {}, `rayproof run ${rayproof.quoted(name)}`) : "";
  }

  function findings(results) {
    const list = merged(results.findings || []);
    const lines = (values, between) => e("bdi", {}, values.map(text).join(between));
    return e("section", { class: "panel", "aria-label": "Findings" }, e("h2", {}, "Findings about references"),
      list.length ? rayproof.scroll("table of findings", e("table", { class: "findings" },
        e("thead", {}, e("tr", {}, ["reference", "what", "stages", "where", "smallest scene", "third witness"].map(th))),
        e("tbody", {}, list.map((finding) => e("tr", {}, e("th", { scope: "row" }, text(finding.reference), e("div", { class: "muted" }, text(finding.version))),
          e("td", {}, e("bdi", {}, text(finding.what))), e("td", {}, lines(finding.stage, ", ")), e("td", {}, lines(finding.where, ", ")),
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
})(window.rayproof);
