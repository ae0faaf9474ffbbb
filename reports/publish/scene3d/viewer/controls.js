// The frame's own controls: layers, what colours the points, and the way back to the first view.
(function (viewer) {
  "use strict";
  const e = window.rayproof.element;

  viewer.layerBoxes = (layers, onchange) => e("fieldset", {}, e("legend", {}, "show"), layers.map((layer) => {
    const box = e("input", { type: "checkbox", checked: true, onchange: () => onchange(layer, box.checked) });
    return e("label", { "data-layer": layer }, box, " ", layer);
  }));

  const MEASURES = [["error", "log\u2081\u2080 of the error"], ["digits", "correct digits"]];

  // -> {node, unit()}; calls onchange(stage, measure, note(scale)) at once and whenever the choice changes.
  viewer.colouring = function (about, table, onchange) {
    const stages = Object.keys(about.points?.stages || {});
    if (!stages.length) return null;
    const low = e("span"), high = e("span");
    const bar = e("canvas", { width: 180, height: 1, "aria-hidden": "true" });
    const chosen = { stage: stages.includes(about.colored) ? about.colored : stages[0], measure: "error" };
    const apply = () => {
      const scale = onchange(chosen.stage, chosen.measure);
      const unit = about.points.stages[chosen.stage].unit;
      const ends = chosen.measure === "error" ? [scale.low, scale.high] : [scale.high, scale.low];
      const words = ends.map((value) => (scale.known ? viewer.told(value * 100, chosen.measure, unit) : "exact"));
      window.rayproof.replace(low, words[0]);
      window.rayproof.replace(high, words[1]);
    };
    const select = (key, title, pairs) => window.rayproof.select(title, pairs, chosen[key], (value) => { chosen[key] = value; apply(); });
    const node = e("div", { class: "colouring" },
      select("stage", "points coloured by", stages.map((stage) => [stage, stage])),
      select("measure", "measure", MEASURES),
      e("div", { class: "scale" }, bar, low, high));
    viewer.bar(bar, table);
    apply();
    return { node, chosen };
  };
})(window.viewer);
