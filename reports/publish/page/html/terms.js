// The words of the report, and what its signs and colours mean.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  const swatches = (results) => Object.entries(results.examined?.words || {}).map(([kind, words]) => e("li", {}, e("i", { class: `swatch k-${kind}`, "aria-hidden": "true" }), words));
  const images = [["nan", "NaN"], ["inf", "infinity"], ["miss", "no hit"], ["zero", "no error"]];

  function legend(results) {
    return e("section", { class: "panel", "aria-label": "Legend" }, e("h1", {}, "Legend"),
      e("h2", {}, "Verdicts"), e("p", {}, rayproof.verdictLegend()),
      e("h2", {}, "What became of a pixel"), e("ul", { class: "kinds" }, swatches(results)),
      e("h2", {}, "Images"), e("p", {}, images.map(([name, words]) => [e("i", { class: `swatch ${name}` }), words, " "]),
        rayproof.explanations.map(({ letter, name }) => [e("span", { class: "kind" }, e("i", { class: `kind-${letter}`, "aria-hidden": "true" }, letter), ` ${name}`), " "])),
      e("h2", {}, "Bars of error / limit"), e("p", {}, rayproof.ratioBar(0.05), " within the limit  ", rayproof.ratioBar(0.9), " above 0.8 of it  ", rayproof.ratioBar(3), " over it: the pixel is wrong. The scale is logarithmic from 0.001 to 10, and the mark is the limit."));
  }

  rayproof.addPage("terms", { title: "Terms", has: (results) => (results.terms || []).length > 0,
    view: (results) => {
      const wanted = rayproof.address().term;
      const node = e("div", {}, legend(results), e("section", { class: "panel", "aria-label": "Terms" }, e("h1", {}, "Terms"),
        e("dl", { class: "facts terms" }, results.terms.map(([word, text]) => [e("dt", { "data-term": word, class: word === wanted ? "current" : null }, word), e("dd", {}, rayproof.prose(text))]))));
      if (wanted) requestAnimationFrame(() => requestAnimationFrame(() => node.querySelector("dt.current")?.scrollIntoView({ block: "center" })));
      return node;
    } });
})(window.rayproof);
