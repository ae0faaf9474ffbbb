// Error metrics of two float32 images, in double precision: what float64 NumPy gives for the same floats.
(function (rayproof) {
  "use strict";

  const bits = new DataView(new ArrayBuffer(4));
  // A float32's place among all float32s, so that neighbours differ by one.
  function place(value) {
    bits.setFloat32(0, value);
    const raw = bits.getInt32(0);
    return raw < 0 ? -(raw & 0x7fffffff) : raw;
  }

  const METRICS = {
    absolute: (a, b) => Math.abs(a - b),
    signed: (a, b) => a - b,
    relative: (a, b) => Math.abs(a - b) / Math.max(Math.abs(a), Math.abs(b)),
    squared: (a, b) => (a - b) ** 2,
    ulp: (a, b) => Math.abs(place(a) - place(b)),
  };
  // Of neighbourhoods rather than of values.
  const MAPS = {
    ssim: (ours, theirs, channel, options) => rayproof.dissimilarity(ours, theirs, channel, options),
    flip: (ours, theirs) => rayproof.flip(ours, theirs),
  };
  rayproof.metrics = [...Object.keys(METRICS), ...Object.keys(MAPS)];
  rayproof.metricTitle = (metric) => ({ ssim: "1 \u2212 SSIM", flip: "FLIP" })[metric] || metric;
  // What two values are compared by where the metric is of neighbourhoods.
  rayproof.ofValues = (metric) => (metric in MAPS ? "absolute" : metric);
  rayproof.isSigned = (metric) => metric === "signed";

  // Equal infinities differ by nothing, two NaN by NaN, an infinity from a number by infinity.
  rayproof.distance = function (metric, a, b) {
    if (a === b) return 0;
    if (Number.isNaN(a) || Number.isNaN(b)) return NaN;
    if (Number.isFinite(a) && Number.isFinite(b)) return (METRICS[metric] || METRICS.absolute)(a, b);
    return metric === "signed" && (a === -Infinity || b === Infinity) ? -Infinity : Infinity;
  };

  // -> {width, height, values: Float64Array, the worst channel's, worst, smallest > 0 by size, differing: pixels}
  rayproof.errors = function (metric, ours, theirs, channel, { compress = false } = {}) {
    const { width, height } = ours;
    const values = metric in MAPS ? MAPS[metric](ours, theirs, channel, { compress }) : pixelwise(metric, ours, theirs, channel);
    let worst = 0, smallest = Infinity, differing = 0, at = 0;
    for (let pixel = 0; pixel < values.length; pixel += 1) {
      const size = Math.abs(values[pixel]);
      if (size !== 0) differing += 1;
      if (!Number.isFinite(size)) continue;
      if (size > worst) { worst = size; at = pixel; }
      if (size > 0 && size < smallest) smallest = size;
    }
    return { metric, width, height, values, worst, smallest, differing, at: [at % width, Math.floor(at / width)] };
  };

  function pixelwise(metric, ours, theirs, channel) {
    const { width, height, channels } = ours;
    const values = new Float64Array(width * height);
    const [from, to] = channel < 0 ? [0, channels] : [channel, channel + 1];
    for (let pixel = 0; pixel < values.length; pixel += 1) {
      let most = 0;
      for (let c = pixel * channels + from; c < pixel * channels + to; c += 1) {
        const value = rayproof.distance(metric, ours.values[c], theirs.values[c]);
        if (Number.isNaN(value)) { most = NaN; break; }
        if (Math.abs(value) > Math.abs(most)) most = value;
      }
      values[pixel] = most;
    }
    return values;
  }

  // The range shown unless another is asked for: six decades below the worst on a log scale, from 0 on a linear one.
  rayproof.autoRange = function (errors, log) {
    const high = errors.worst || (errors.metric === "ulp" ? 1 : 1e-7);
    if (!log) return [0, high];
    const low = Math.max(errors.worst ? errors.smallest : high / 10, high / 1e6);
    return [Math.min(low, high / 3), high];
  };

  // Where a size lies in a range: 0 at its low end, 1 at its high end.
  rayproof.position = function (value, [low, high], log) {
    const size = Math.abs(value);
    if (!log) return (size - low) / (high - low);
    return Math.log10(size / low) / Math.log10(high / low);
  };
})(window.rayproof);
