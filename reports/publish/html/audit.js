// What the harness is worth: the audit's score, and the matrix of planted faults against references and families.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  const sides = (text) => e("td", {}, text || "");

  // Seen by nobody where it was not looked for; a dot where a case met the fault and showed nothing of it.
  function cell(look) {
    if (!look) return e("td", {});
    const title = `${look.killed} of ${look.cases} cases`;
    return e("td", { title }, look.killed ? look.stage : e("span", { class: "muted" }, "\u00B7"));
  }

  function reference(look) {
    if (!look) return e("td", {});
    if (!look.sees) return e("td", { title: "does not answer this stage where the fault shows" }, e("span", { class: "muted" }, "\u2013"));
    return sides(look.killed ? look.stage : "missed");
  }

  const outcome = (fault) => {
    if (fault.equivalent) return e("span", { class: "muted", title: fault.equivalent }, "equivalent");
    const good = fault.killed && fault.blamed_right;
    const name = good ? "pass" : "fail";
    return e("span", { class: `glyph mark ${rayproof.tone(name)}`, title: (fault.killed_by || []).join("\n") }, rayproof.glyph(name));
  };

  function matrix(audit) {
    const titles = ["fault", "where", "spoils", "", "blamed", ...audit.references, ...audit.families];
    return e("div", { class: "scroll" }, e("table", {},
      e("thead", {}, e("tr", {}, titles.map((title) => e("th", { scope: "col" }, title)))),
      e("tbody", {}, audit.faults.map((fault) => e("tr", {},
        e("th", { scope: "row" }, fault.name), sides(fault.where), sides(fault.stage), e("td", {}, outcome(fault)),
        sides(fault.blamed_stage),
        audit.references.map((name) => reference((fault.references || {})[name])),
        audit.families.map((name) => cell((fault.families || {})[name])))))));
  }

  function graded(smallest) {
    const rows = Object.entries(smallest).flatMap(([quantity, found]) =>
      Object.entries(found).map(([precision, stages]) => [quantity, precision, stages]));
    if (!rows.length) return null;
    const stages = [...new Set(rows.flatMap((row) => Object.keys(row[2])))];
    return e("div", { class: "scroll" }, e("h3", {}, "Smallest relative error that each stage detects"), e("table", {},
      e("thead", {}, e("tr", {}, ["quantity", "precision", ...stages].map((title) => e("th", { scope: "col" }, title)))),
      e("tbody", {}, rows.map(([quantity, precision, found]) => e("tr", {}, e("th", { scope: "row" }, quantity),
        sides(precision), stages.map((stage) => e("td", { class: "figure" },
          stage in found ? Number(found[stage]).toExponential(0) : "")))))));
  }

  rayproof.audit = function (results) {
    const audit = results.audit;
    if (!audit) return null;
    const name = audit.good ? "pass" : "fail";
    return e("section", { class: "panel", "aria-label": "Audit" },
      e("p", {}, e("span", { class: `glyph mark ${rayproof.tone(name)}` }, rayproof.glyph(name)), " ", audit.sentence),
      audit.problems.length ? e("ul", {}, audit.problems.slice(0, 20).map((text) => e("li", {}, e("bdi", {}, text)))) : null,
      e("details", {}, e("summary", {}, "Kill matrix: fault by reference and family, with the stage blamed"),
        graded(audit.smallest), matrix(audit)));
  };
})(window.rayproof);
