// Everybody judged against everybody at one stage, and who stands alone.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  // panel: {baseline, renderers, ratio: rows judged by columns, differing, alone, why}
  rayproof.adjudication = function (panel) {
    if (!panel || !Array.isArray(panel.renderers) || panel.renderers.length < 2) return null;
    const { renderers } = panel;
    const alone = String(panel.alone ?? "").split(", ");
    // Who can be compared with nobody here has nothing to say.
    const heard = renderers.map((_, i) => i).filter((i) => renderers.some((_, j) => value(panel.ratio, i, j) !== null || value(panel.ratio, j, i) !== null));
    const cell = (i, j) => {
      if (i === j) return e("td", { class: "self", title: renderers[i] }, "\u2013");
      const ratio = value(panel.ratio, i, j);
      if (ratio === null) return e("td", { class: "muted", title: "cannot be compared" }, "\u00B7");
      const bad = !(ratio <= 1);
      const pixels = value(panel.differing, i, j);
      return e("td", { class: `figure ${rayproof.tone(bad ? "fail" : "pass")} ${bad ? "over" : ""}`,
        title: `${renderers[i]} against ${renderers[j]}: ${rayproof.short(ratio)} times the limit, ${pixels ?? "?"} interior pixels over it` },
      e("span", { class: "mark glyph" }, rayproof.glyph(bad ? "fail" : "pass")), " ", rayproof.short(ratio, 2), bad && pixels ? e("small", {}, ` ${pixels} px`) : null);
    };
    return e("section", { class: "adjudication", "aria-label": "Everybody against everybody" }, e("h3", {}, "Everybody against everybody"),
      panel.why ? e("p", {}, e("bdi", {}, panel.why)) : null,
      e("details", { open: panel.alone ? true : null }, e("summary", {}, `Worst error over limit, ${heard.length} renderers: row judged against column`),
        rayproof.scroll("matrix of renderers", e("table", { class: "versus" },
          e("thead", {}, e("tr", {}, e("td"), heard.map((j) => e("th", { scope: "col" }, e("span", {}, renderers[j]))))),
          e("tbody", {}, heard.map((i) => e("tr", { class: alone.includes(renderers[i]) ? "alone" : "" },
            e("th", { scope: "row" }, renderers[i], alone.includes(renderers[i]) ? " \u2190 alone" : ""), heard.map((j) => cell(i, j)))))))));
  };

  const value = (table, i, j) => rayproof.number(table?.[i]?.[j]);
})(window.rayproof);
