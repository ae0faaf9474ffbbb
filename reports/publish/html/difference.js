// The difference of two float32 images, in double precision: what float64 NumPy gives for the same floats.
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
    relative: (a, b) => Math.abs(a - b) / Math.max(Math.abs(a), Math.abs(b)),
    ulp: (a, b) => Math.abs(place(a) - place(b)),
  };
  rayproof.metrics = Object.keys(METRICS);

  // Equal infinities differ by nothing, two NaN by NaN, an infinity from a number by infinity.
  rayproof.distance = function (metric, a, b) {
    if (a === b) return 0;
    if (Number.isNaN(a) || Number.isNaN(b)) return NaN;
    return Number.isFinite(a) && Number.isFinite(b) ? METRICS[metric](a, b) : Infinity;
  };

  // -> {width, height, values: Float64Array, the worst channel's, worst, smallest > 0, differing: pixels}
  rayproof.difference = function (metric, ours, theirs, channel) {
    const { width, height, channels } = ours;
    const values = new Float64Array(width * height);
    let worst = 0, smallest = Infinity, differing = 0, at = 0;
    for (let pixel = 0; pixel < values.length; pixel += 1) {
      let most = 0;
      for (let c = 0; c < channels; c += 1) {
        if (channel >= 0 && c !== channel) continue;
        const value = rayproof.distance(metric, ours.values[pixel * channels + c], theirs.values[pixel * channels + c]);
        if (Number.isNaN(value)) { most = NaN; break; }
        if (value > most) most = value;
      }
      values[pixel] = most;
      if (most !== 0) differing += 1;
      if (Number.isFinite(most)) {
        if (most > worst) { worst = most; at = pixel; }
        if (most > 0 && most < smallest) smallest = most;
      }
    }
    return { width, height, values, worst, smallest, differing, at: [at % width, Math.floor(at / width)] };
  };

  // Log scale over at most six decades below the worst; `gain` stops shift it. Equal pixels are black.
  rayproof.differenceScale = function (difference, gain) {
    const top = Math.log10((difference.worst || 1) / 2 ** gain);
    const low = Math.max(difference.worst ? Math.log10(difference.smallest) : top - 1, top - 6);
    return { top, low: Math.min(low, top - 0.5) };
  };

  rayproof.paintDifference = function (difference, scale) {
    const picture = new ImageData(difference.width, difference.height);
    const { table, at } = rayproof.viridis;
    difference.values.forEach((value, pixel) => {
      let color = [12, 12, 16];
      if (Number.isNaN(value)) color = rayproof.NAN;
      else if (value === Infinity) color = rayproof.INFINITE;
      else if (value > 0) {
        const start = at((Math.log10(value) - scale.low) / (scale.top - scale.low));
        color = table.subarray(start, start + 3);
      }
      picture.data.set([color[0], color[1], color[2], 255], 4 * pixel);
    });
    return picture;
  };
})(window.rayproof);
