// What the harness is worth: the audit's score, and the matrix of planted faults against references and families.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  const th = (title) => e("th", { scope: "col" }, title);
  const upright = (title) => e("th", { scope: "col", class: "upright" }, e("span", {}, title));

  // Empty where no case was looked at; a dot where cases met the fault and showed nothing of it.
  function family(look) {
    if (!look) return e("td", {});
    const title = `${look.killed} of ${look.cases} cases`;
    return e("td", { title, class: look.killed ? "killed" : "" }, look.killed ? look.stage : e("span", { class: "muted" }, "\u00B7"));
  }

  function reference(look) {
    if (!look) return e("td", {});
    if (!look.sees) return e("td", { title: "does not answer this stage where the fault shows" }, e("span", { class: "muted" }, "\u2013"));
    return look.killed ? e("td", { class: "killed" }, look.stage) : e("td", { class: "missed", title: (look.missed || []).join("\n") }, "missed");
  }

  const STATES = { killed: "killed, blamed right", wrong: "killed, blamed wrong", survived: "survived", equivalent: "equivalent" };
  function state(fault) {
    if (fault.equivalent) return "equivalent";
    return !fault.killed ? "survived" : fault.blamed_right ? "killed" : "wrong";
  }
  const TONES = { killed: "pass", wrong: "warn", survived: "fail", equivalent: "unsupported" };

  function outcome(fault) {
    const name = TONES[state(fault)];
    const why = fault.equivalent || (fault.killed_by || []).join("\n");
    return e("td", { title: why }, e("span", { class: `glyph mark ${rayproof.tone(name)}` }, rayproof.glyph(name)), " ",
      e("span", { class: "muted" }, state(fault)));
  }

  function story(fault, columns) {
    return e("tr", { class: "derivation" }, e("td", { colspan: columns },
      fault.equivalent ? e("p", {}, e("strong", {}, "Equivalent: "), fault.equivalent) : null,
      (fault.killed_by || []).map((text) => e("p", {}, e("bdi", {}, text))),
      (fault.wrongly_blamed || []).map((text) => e("p", {}, e("strong", {}, "Blamed wrongly: "), e("bdi", {}, String(text)))),
      (fault.blamed_items || []).length ? e("p", {}, e("strong", {}, fault.items_right === false ? "Items blamed, not its own: " : "Items blamed: "),
        fault.blamed_items.join(", ")) : null,
      e("p", { class: "muted" }, [(fault.covers || []).join(", "), fault.erratum && `erratum ${fault.erratum}`].filter(Boolean).join(" \u00B7 ")),
      rayproof.command(`rayproof audit --only ${rayproof.quoted(fault.name)}`)));
  }

  function matrix(audit, faults) {
    const width = 5 + audit.references.length + audit.families.length;
    const row = (fault) => {
      const line = e("tr", {},
        e("th", { scope: "row" }, e("button", { class: "link", "aria-expanded": "false", onclick: (event) => {
          const open = event.target.getAttribute("aria-expanded") === "true";
          event.target.setAttribute("aria-expanded", String(!open));
          if (open) line.nextSibling.remove();
          else line.after(story(fault, width));
        } }, fault.name)), e("td", {}, fault.where), e("td", {}, fault.stage || ""), outcome(fault), e("td", {}, fault.blamed_stage || ""),
        audit.references.map((name) => reference((fault.references || {})[name])),
        audit.families.map((name) => family((fault.families || {})[name])));
      return line;
    };
    return rayproof.scroll("table of faults", e("table", { class: "kills" },
      e("thead", {}, e("tr", {}, ["fault", "where", "spoils", "outcome", "blamed"].map(th),
        audit.references.map(upright), audit.families.map(upright))),
      e("tbody", {}, faults.map(row))));
  }

  function graded(smallest) {
    const rows = Object.entries(smallest).flatMap(([quantity, found]) =>
      Object.entries(found).map(([precision, stages]) => [quantity, precision, stages]));
    if (!rows.length) return null;
    const stages = [...new Set(rows.flatMap((row) => Object.keys(row[2])))];
    return e("section", { class: "panel" }, e("h2", {}, "Smallest relative error that each stage detects"), rayproof.scroll("table of smallest errors", e("table", {},
      e("thead", {}, e("tr", {}, ["quantity", "precision", ...stages].map(th))),
      e("tbody", {}, rows.map(([quantity, precision, found]) => e("tr", {}, e("th", { scope: "row" }, quantity),
        e("td", {}, precision), stages.map((stage) => e("td", { class: "figure" },
          stage in found ? Number(found[stage]).toExponential(0) : ""))))))));
  }

  function score(audit, link) {
    const name = audit.good ? "pass" : "fail";
    return e("p", {}, e("span", { class: `glyph mark ${rayproof.tone(name)}` }, rayproof.glyph(name)), " ", audit.sentence, " ", link);
  }

  const problems = (audit) => (audit.problems.length
    ? e("ul", {}, audit.problems.slice(0, 20).map((text) => e("li", {}, e("bdi", {}, text)))) : null);

  // On the front page: the score, and where the matrix is.
  rayproof.audit = function (results) {
    const audit = results.audit;
    if (!audit) return null;
    return e("section", { class: "panel", "aria-label": "Audit" },
      score(audit, e("a", { href: rayproof.link({ page: "audit" }) }, "kill matrix")), problems(audit));
  };

  function filtered(audit) {
    const place = e("div"), count = e("span", { class: "muted", role: "status" }), controls = e("div", { class: "controls" });
    const distinct = (pick) => [...new Set(audit.faults.map(pick).filter(Boolean))].sort();
    function show() {
      const wanted = rayproof.address();
      const words = (wanted.q || "").toLowerCase().split(/\s+/).filter(Boolean);
      const faults = audit.faults.filter((fault) => (!wanted.where || fault.where === wanted.where) && (!wanted.spoils || fault.stage === wanted.spoils)
        && (!wanted.outcome || state(fault) === wanted.outcome) && words.every((word) => `${fault.name} ${(fault.covers || []).join(" ")}`.toLowerCase().includes(word)));
      rayproof.replace(count, `${faults.length} of ${audit.faults.length}`);
      rayproof.replace(place, faults.length ? matrix(audit, faults) : e("p", { class: "muted" }, "No fault matches."));
    }
    const pick = (key, title, pairs) => rayproof.select(title, [["", "any"], ...pairs], rayproof.address()[key] || "", (value) => { rayproof.amend({ [key]: value }); show(); });
    const search = e("input", { type: "search", "aria-label": "search faults", placeholder: "name or id \u2026", value: rayproof.address().q || "",
      oninput: () => { rayproof.amend({ q: search.value }); show(); } });
    rayproof.append(controls, [pick("outcome", "outcome", Object.entries(STATES)), pick("where", "planted in", distinct((fault) => fault.where).map((one) => [one, one])),
      pick("spoils", "spoils", distinct((fault) => fault.stage).map((one) => [one, one])), e("label", { class: "control grow" }, e("span", {}, "search"), search)]);
    show();
    return e("section", { class: "panel" }, e("h2", {}, "Kill matrix ", count), controls, place,
      e("p", { class: "muted legend" }, "Cells hold the stage that was blamed. \u00B7 met, nothing seen; \u2013 does not answer this stage; empty: not looked at. A fault's name opens what killed it."));
  }

  rayproof.addPage("audit", { title: "Audit", has: (results) => Boolean(results.audit), view: (results) => e("div", {},
    e("section", { class: "panel" }, e("h1", {}, "Audit: what the harness is worth"), score(results.audit), problems(results.audit)),
    filtered(results.audit), graded(results.audit.smallest)) });
})(window.rayproof);
