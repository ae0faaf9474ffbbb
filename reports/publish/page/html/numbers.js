// Numbers as text. results.json writes what JSON cannot carry as "inf", "-inf" and "nan".
(function (rayproof) {
  "use strict";

  rayproof.number = function (value) {
    if (typeof value === "number") return value;
    return { inf: Infinity, "-inf": -Infinity, nan: NaN }[value] ?? null;
  };

  function special(value) {
    if (Number.isNaN(value)) return "NaN";
    if (value === Infinity) return "inf";
    if (value === -Infinity) return "-inf";
    return Object.is(value, -0) ? "-0" : null;
  }

  // Few digits, for tables.
  rayproof.short = function (value, digits = 3) {
    value = rayproof.number(value);
    if (value === null) return "";
    const text = special(value);
    if (text !== null) return text;
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  };

  // As few digits as give back exactly this float32 (nine always do).
  rayproof.exact = function (value) {
    const text = special(value);
    if (text !== null) return text;
    for (let digits = 1; digits < 9; digits += 1) {
      const candidate = Number(value.toPrecision(digits));
      if (Math.fround(candidate) === value) return String(candidate);
    }
    return String(Number(value.toPrecision(9)));
  };

  rayproof.seconds = function (value) {
    value = rayproof.number(value);
    if (value === null) return "";
    return value < 10 ? `${value.toFixed(2)} s` : value < 120 ? `${value.toFixed(0)} s` : `${(value / 60).toFixed(1)} min`;
  };

  // Error over limit as a bar on a log scale from 1/1000 to 10, the limit marked; and the number.
  rayproof.ratioBar = function (value) {
    const e = rayproof.element;
    value = rayproof.number(value);
    if (value === null) return e("span", { class: "muted" }, "\u2013");
    const share = Number.isNaN(value) ? 1 : Math.min(1, Math.max(0, (Math.log10(Math.max(value, 1e-3)) + 3) / 4));
    const over = !(value <= 1);
    const fill = e("i", { class: over ? "over" : value > 0.8 ? "close" : "" });
    fill.style.width = `${100 * share}%`;
    const title = "worst error over its limit; log scale from 0.001 to 10, the mark is the limit";
    return e("span", { class: "ratio", title }, e("span", { class: "bar" }, fill), rayproof.short(value));
  };
})(window.rayproof);
