// The seven verdicts: a shape and a word beside every colour, best first as in reports/judge/outcomes.py.
(function (rayproof) {
  "use strict";

  const VERDICTS = {
    pass: ["\u2713", "pass"],
    warn: ["\u25B2", "warn"],
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
  rayproof.worst = (verdicts) => ORDER[Math.max(-1, ...verdicts.map((verdict) => ORDER.indexOf(verdict)))] || null;

  rayproof.pill = function (verdict) {
    const e = rayproof.element;
    return e("span", { class: `pill ${rayproof.tone(verdict)}` },
      e("span", { "aria-hidden": "true", class: "glyph" }, rayproof.glyph(verdict)), rayproof.word(verdict));
  };

  // One reference's word on one case, from {verdict: count}.
  rayproof.cell = function (counts, reference) {
    const e = rayproof.element;
    if (!counts) return e("span", { class: "cell none", title: `${reference}: not asked` }, "\u00B7");
    const measured = Object.keys(counts).filter((verdict) => verdict !== "unsupported");
    const verdict = measured.length ? rayproof.worst(measured) : "unsupported";
    const total = Object.values(counts).reduce((sum, count) => sum + count, 0);
    const text = Object.entries(counts).map(([name, count]) => `${count} ${rayproof.word(name)}`).join(", ");
    const partial = measured.length && counts.unsupported ? "*" : "";
    return e("span", { class: `cell ${rayproof.tone(verdict)}`, title: `${reference}: ${text}` },
      e("span", { class: "glyph" }, rayproof.glyph(verdict)), ` ${measured.length ? counts[verdict] : total}${partial}`);
  };
})(window.rayproof);
