// The eight verdicts: a shape and a word beside every colour, best first as in reports/results/outcomes.py.
(function (rayproof) {
  "use strict";

  const VERDICTS = {
    pass: ["\u2713", "pass"],
    warn: ["\u25B2", "warn"],
    undecided: ["\u25D0", "undecided"],
    unsupported: ["\u25CB", "unsupported"],
    missing: ["?", "missing"],
    reference_suspect: ["\u25C6", "reference suspect"],
    error: ["\u25A0", "error"],
    fail: ["\u2715", "fail"],
  };
  const ORDER = Object.keys(VERDICTS);
  rayproof.verdicts = ORDER;

  rayproof.glyph = (verdict) => (VERDICTS[verdict] || ["?"])[0];
  rayproof.word = (verdict) => (VERDICTS[verdict] || [null, String(verdict)])[1];
  rayproof.tone = (verdict) => `v-${ORDER.includes(verdict) ? verdict : "missing"}`;
  // What is undecided says nothing: the others decide, if there are any.
  rayproof.worst = function (verdicts) {
    const decided = verdicts.filter((verdict) => verdict !== "undecided");
    return ORDER[Math.max(-1, ...(decided.length ? decided : verdicts).map((verdict) => ORDER.indexOf(verdict)))] || null;
  };

  rayproof.pill = function (verdict) {
    const e = rayproof.element;
    return e("span", { class: `pill ${rayproof.tone(verdict)}` },
      e("span", { "aria-hidden": "true", class: "glyph" }, rayproof.glyph(verdict)), rayproof.word(verdict));
  };

  // One renderer's word on one case: [worst verdict, checks that have it, all checks, worst ratio, stages unsupported].
  rayproof.cell = function (cell, renderer) {
    const e = rayproof.element;
    if (!cell) return e("span", { class: "cell none", title: `${renderer}: not asked` }, "\u00B7");
    const [verdict, count, total, ratio, unsupported] = cell;
    const partial = unsupported && verdict !== "unsupported" ? "*" : "";
    const title = `${renderer}: ${count} of ${total} checks ${rayproof.word(verdict)}`
      + (ratio === null ? "" : `, worst error ${rayproof.short(ratio)} of its limit`) + (unsupported ? `, ${unsupported} stages unsupported` : "");
    return e("span", { class: `cell ${rayproof.tone(verdict)}`, title },
      e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(verdict)), e("span", { class: "offscreen" }, rayproof.word(verdict)), ` ${verdict === "unsupported" ? unsupported : count}${partial}`);
  };
})(window.rayproof);
