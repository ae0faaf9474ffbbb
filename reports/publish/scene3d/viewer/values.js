// What colours the hit points: log10 of the error, or correct digits, of one stage. Bright is bad in both.
(function (viewer) {
  "use strict";

  const HUNDREDTHS = 100;

  // -> {low, high, shares: Float32Array, how bad each point is from 0 to 1}
  viewer.scaled = function (values, measure) {
    const known = values.filter((value) => typeof value === "number");
    const low = known.length ? Math.min(...known) : 0;
    const high = known.length ? Math.max(...known) : 0;
    const width = high - low || 1;
    const worse = measure === "error" ? (value) => (value - low) / width : (value) => (high - value) / width;
    // Exact is as good as the best there is, no number as bad as the worst.
    const shares = Float32Array.from(values, (value) => (value === null ? 0 : value === "nan" ? 1 : worse(value)));
    return { low: low / HUNDREDTHS, high: high / HUNDREDTHS, known: known.length, shares };
  };

  viewer.colour = function (actor, shares) {
    const data = actor.getMapper().getInputData();
    data.getPointData().getScalars().setData(shares);
    data.getPointData().modified();
    data.modified();
  };

  // Numbers for people: an error in its unit, or digits.
  viewer.told = function (value, measure, unit) {
    if (value === null) return "exact";
    if (value === "nan") return "no number";
    if (measure === "digits") return `${(value / HUNDREDTHS).toFixed(1)} digits`;
    return `${(10 ** (value / HUNDREDTHS)).toExponential(1)}${unit && unit !== "1" ? ` ${unit}` : ""}`;
  };

  // A bar of the colours as they are drawn, from good to bad.
  viewer.bar = function (canvas, table) {
    const context = canvas.getContext("2d");
    const picture = context.createImageData(canvas.width, 1);
    const rgb = [];
    for (let i = 0; i < canvas.width; i += 1) {
      table.getColor(i / (canvas.width - 1), rgb);
      picture.data.set([...rgb.map((value) => Math.round(255 * value)), 255], 4 * i);
    }
    context.putImageData(picture, 0, 0);
  };
})(window.viewer);
