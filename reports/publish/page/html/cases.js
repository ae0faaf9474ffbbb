// The matrix of cases and renderers, worst first; filters and order live in the address.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  rayproof.caseList = function (results) {
    const count = e("span", { class: "muted", role: "status" });
    const controls = e("div", { class: "controls" });
    const head = e("tr");
    const holder = e("div", { class: "scroll" });
    let rows = [], columns = [], virtual = null, table = null;

    const cells = (row) => [
      e("td", { class: "state" }, rayproof.pill(row.verdict)),
      e("th", { scope: "row", class: "name" }, e("a", { href: rayproof.link({ case: row.name, stage: row.stage }) }, e("bdi", {}, row.name)),
        e("div", { class: "muted" }, row.verdict === "pass" ? row.stresses : row.reason || row.stresses || "\u00A0")),
      e("td", { class: "blame" }, row.blame),
      e("td", {}, rayproof.ratioBar(row.ratio)),
      columns.map((name) => e("td", { class: "matrix", "data-label": name }, row.cells ? rayproof.cell(row.cells[name], name) : null)),
      e("td", { class: "figure time" }, rayproof.seconds(row.seconds))];

    function line(row) {
      const node = e("tr", { class: rayproof.tone(row.verdict) }, cells(row));
      rayproof.complete(row)?.then(() => {
        const held = node.contains(document.activeElement);
        rayproof.replace(node, cells(row));
        if (held) node.querySelector("a").focus();
      }, () => {}); // what the page has of it stays
      return node;
    }

    function heading(order) {
      const title = (key, text, more = {}) => {
        const now = order.replace(/^-/, "") === key ? (order.startsWith("-") ? "descending" : "ascending") : null;
        const first = rayproof.descends(key) ? `-${key}` : key, second = rayproof.descends(key) ? key : `-${key}`;
        return e("th", { scope: "col", "aria-sort": now, ...more }, e("button", { class: "sorter", title: `sort by ${text}`,
          onclick: () => set({ sort: order === first ? second : order === second ? "" : first }) }, text,
        e("span", { "aria-hidden": "true" }, now === "descending" ? " \u25BE" : now ? " \u25B4" : "")));
      };
      return [title("verdict", "verdict"), title("name", "case", { class: "name" }), title("blame", "blamed"), title("ratio", "error / limit"),
        columns.map((name) => (results.list ? e("th", { scope: "col", class: "matrix" }, name) : title(`by ${name}`, name, { class: "matrix" }))), title("time", "time", { class: "figure" })];
    }

    function show() {
      const filter = rayproof.address();
      rows = rayproof.sorted(results.cases.filter((row) => rayproof.matches(row, filter)), filter.sort || "");
      const total = rows.length === results.cases.length ? `${rows.length}` : `${rows.length} of ${results.cases.length}`;
      rayproof.replace(count, filter.sort ? total : `${total}, worst first`);
      rayproof.replace(head, heading(filter.sort || ""));
      table.setAttribute("aria-rowcount", rows.length + 1);
      virtual.show(rows);
      if (!rows.length) rayproof.append(virtual.body, [e("tr", {}, e("td", { colspan: 5 + columns.length, class: "muted" }, "No case matches."))]);
    }

    function set(parts) {
      rayproof.amend(parts);
      build();
      show();
    }

    function build() {
      const filter = rayproof.address();
      const held = controls.contains(document.activeElement) ? document.activeElement.getAttribute("aria-label") : null;
      columns = filter.columns === "ours" ? results.columns.ours : results.columns.references;
      virtual = rayproof.virtualBody(line, 5 + columns.length);
      table = e("table", { class: "cases" }, e("thead", {}, head), virtual.body);
      rayproof.replace(holder, table);
      const distinct = (key) => [...new Set(results.cases.map((row) => row[key]))].sort();
      const present = rayproof.verdicts.filter((name) => results.cases.some((row) => row.verdict === name)).reverse();
      const pick = (key, title, values) => rayproof.select(title, [["", `any ${title}`], ...values.map((value) => [value, rayproof.word(value)])],
        filter[key] || "", (value) => set({ [key]: value }));
      const search = e("input", { type: "search", placeholder: results.list ? "name, id, blamed \u2026" : "name, reason, id \u2026", "aria-label": "search",
        value: filter.q || "", oninput: () => { rayproof.amend({ q: search.value }); show(); } });
      rayproof.replace(controls, pick("verdict", "verdict", present), pick("family", "family", distinct("family")),
        pick("id", "id", results.coverage.map((item) => item.id)), pick("stage", "stage", results.stages.map((stage) => stage.name)),
        e("label", { class: "control grow" }, e("span", {}, "search"), search),
        results.columns.ours.length > 1 ? rayproof.select("columns", [["", "references"], ["ours", "under test"]], filter.columns || "", (value) => set({ columns: value, sort: "" })) : null,
        rayproof.filters.some((key) => filter[key]) ? e("button", { class: "quiet", onclick: clear }, "clear") : null);
      if (held) controls.querySelector(`[aria-label="${CSS.escape(held)}"]`)?.focus();
    }

    const clear = () => set(Object.fromEntries(rayproof.filters.map((key) => [key, ""])));

    // The next case of the list gets the focus, from wherever it is.
    function step(by) {
      const current = document.activeElement?.closest?.(".cases tbody tr");
      const at = current ? Number(current.getAttribute("aria-rowindex")) - 2 + by : 0;
      if (at >= 0 && at < rows.length) virtual.reveal(at)?.querySelector("a").focus();
    }

    build();
    show();
    const section = e("section", { class: "panel", id: "cases", "aria-label": "Cases" },
      e("h2", {}, "Cases ", count), controls, holder,
      e("p", { class: "muted legend" }, "Per renderer: its worst verdict and how many checks have it; * some stages unsupported; ",
        rayproof.verdicts.map((name) => [e("span", { class: `glyph mark ${rayproof.tone(name)}` }, rayproof.glyph(name)), " ", rayproof.word(name), "  "])));
    return { section, set: (parts) => { set(parts); section.scrollIntoView(); }, search: () => controls.querySelector("input")?.focus(),
      clear, step, rows: () => rows, laid: () => virtual.laid() };
  };
})(window.rayproof);
