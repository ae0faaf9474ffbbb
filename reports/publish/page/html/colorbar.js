// The colour bar of the error image: its range, choosable, and where the limit lies on it.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  function bar(signed, map) {
    const canvas = e("canvas", { width: 256, height: 1, class: "colorbar", "aria-hidden": "true" });
    const picture = new ImageData(256, 1);
    for (let i = 0; i < 256; i += 1) picture.data.set([...rayproof.mapped(signed ? "signed" : map, i / 255), 255], 4 * i);
    canvas.getContext("2d", { willReadFrequently: true }).putImageData(picture, 0, 0);
    return canvas;
  }

  // onrange(low, high): numbers, or null for the automatic end.
  rayproof.colorBar = function ({ errors, range, log, map, unit, limit, onrange }) {
    const signed = rayproof.isSigned(errors.metric);
    const field = (title, value, act) => e("input", { type: "text", inputmode: "decimal", size: 8, "aria-label": title, value: rayproof.short(value, 3),
      onchange: (event) => act(Number(event.target.value) > 0 ? Number(event.target.value) : null) });
    const [low, high] = range;
    const at = limit === null ? null : rayproof.position(limit, range, log);
    const place = signed ? 0.5 + at / 2 : at;
    const mark = e("i", { class: "limit-mark", title: limit === null ? "" : `limit at its worst pixel: ${rayproof.short(limit)}` });
    if (at !== null) mark.style.left = `${100 * place}%`;
    return e("div", { class: "scale" },
      e("div", { class: "bar-holder" }, bar(signed, map), at !== null && at >= 0 && at <= 1 ? mark : null),
      log || signed ? field("low end of the range", low, (value) => onrange(value, high)) : e("span", { class: "end" }, "0"),
      e("span", { class: "muted" }, signed ? `\u00B1 ${unit}` : unit,
        e("button", { class: "quiet", title: "the range of the errors", onclick: () => onrange(null, null) }, "auto"),
        limit === null ? null : e("button", { class: "quiet", title: "a thousandth of the limit to the limit", onclick: () => onrange(limit / 1000, limit) }, "to limit")),
      field("high end of the range", high, (value) => onrange(low, value)));
  };
})(window.rayproof);
