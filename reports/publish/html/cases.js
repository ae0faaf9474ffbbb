// The list of cases, worst first, with filters that live in the address.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const FILTERS = ["verdict", "family", "id", "stage", "q"];

  function matches(row, filter) {
    if (filter.verdict && row.verdict !== filter.verdict) return false;
    if (filter.family && row.family !== filter.family) return false;
    if (filter.id && !(row.covers || []).includes(filter.id)) return false;
    if (filter.stage && !row.stages.includes(filter.stage) && row.stage !== filter.stage) return false;
    const words = (filter.q || "").toLowerCase().split(/\s+/).filter(Boolean);
    const text = [row.name, row.reason, row.stresses, row.blame, ...(row.covers || [])].join(" ").toLowerCase();
    return words.every((word) => text.includes(word));
  }

  function line(row, references) {
    return e("tr", { class: rayproof.tone(row.verdict) },
      e("td", { class: "state" }, rayproof.pill(row.verdict)),
      e("td", { class: "name" }, e("a", { href: rayproof.link({ case: row.name, stage: row.stage }) }, e("bdi", {}, row.name)),
        e("div", { class: "muted" }, row.verdict === "pass" ? row.stresses : row.reason || row.stresses)),
      e("td", { class: "blame" }, row.blame),
      e("td", {}, rayproof.ratioBar(row.ratio)),
      references.map((name) => e("td", { class: "matrix", "data-label": name }, rayproof.cell(row.cells[name], name))),
      e("td", { class: "figure time" }, rayproof.seconds(row.seconds)));
  }

  rayproof.caseList = function (results) {
    const references = [...new Set([...Object.keys(results.references || {}),
      ...results.cases.flatMap((row) => Object.keys(row.cells))])];
    const body = e("tbody");
    const count = e("span", { class: "muted", role: "status" });
    const controls = e("div", { class: "controls" });
    const choices = (title, values) => [["", `any ${title}`], ...values.map((value) => [value, rayproof.word(value)])];

    function show() {
      const filter = rayproof.address();
      const rows = results.cases.filter((row) => matches(row, filter));
      rayproof.replace(count, rows.length === results.cases.length ? `${rows.length}, worst first`
        : `${rows.length} of ${results.cases.length}, worst first`);
      rayproof.replace(body, rows.map((row) => line(row, references)));
      if (!rows.length) rayproof.append(body, [e("tr", {}, e("td", { colspan: 5 + references.length, class: "muted" },
        "No case matches."))]);
    }

    function set(parts) {
      rayproof.amend(parts);
      build();
      show();
    }

    function build() {
      const filter = rayproof.address();
      const distinct = (pick) => [...new Set(results.cases.flatMap(pick))].sort();
      const present = rayproof.verdicts.filter((name) => results.cases.some((row) => row.verdict === name)).reverse();
      const pick = (key, title, values) => rayproof.select(title, choices(title, values), filter[key] || "",
        (value) => set({ [key]: value }));
      const search = e("input", { type: "search", placeholder: "name, reason, id \u2026", "aria-label": "search",
        value: filter.q || "", oninput: () => { rayproof.amend({ q: search.value }); show(); } });
      rayproof.replace(controls, pick("verdict", "verdict", present),
        pick("family", "family", distinct((row) => [row.family])),
        pick("id", "id", results.coverage.map((item) => item.id)),
        pick("stage", "stage", results.stages.map((stage) => stage.name)),
        e("label", { class: "control grow" }, e("span", {}, "search"), search),
        FILTERS.some((key) => filter[key]) ? e("button", { class: "quiet", onclick: () =>
          set(Object.fromEntries(FILTERS.map((key) => [key, ""]))) }, "clear") : null);
    }

    build();
    show();
    const section = e("section", { class: "panel", id: "cases", "aria-label": "Cases" },
      e("h2", {}, "Cases ", count), controls,
      e("div", { class: "scroll" }, e("table", { class: "cases" },
        e("thead", {}, e("tr", {}, e("th", {}, "verdict"), e("th", {}, "case"), e("th", {}, "blamed"),
          e("th", {}, "error / limit"), references.map((name) => e("th", { class: "matrix" }, e("span", {}, name))),
          e("th", { class: "figure" }, "time"))),
        body)),
      e("p", { class: "muted legend" }, "Per reference: its worst verdict and how many checks have it; * some stages unsupported; ",
        rayproof.verdicts.map((name) => [rayproof.glyph(name), " ", rayproof.word(name), "  "])));
    return { section, set: (parts) => { set(parts); section.scrollIntoView(); } };
  };
})(window.rayproof);
