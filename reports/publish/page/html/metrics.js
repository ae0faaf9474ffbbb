// Separable filters of a plane in double precision: along the rows, and down the columns.
(function (rayproof) {
  "use strict";
  // Which pixel stands for one beyond the border: the border's own, or the one as far inside.
  rayproof.held = (i, size) => Math.min(size - 1, Math.max(0, i));
  rayproof.mirrored = (i, size) => {
    const place = ((i % (2 * size)) + 2 * size) % (2 * size);
    return place < size ? place : 2 * size - 1 - place;
  };

  // Weights at -radius, ..., radius, and the same summing to 1.
  rayproof.sampled = (radius, of) => Array.from({ length: 2 * radius + 1 }, (_, i) => of(i - radius));
  rayproof.normalized = (kernel) => { const sum = kernel.reduce((a, b) => a + b, 0); return kernel.map((weight) => weight / sum); };

  const places = (size, radius, beyond) => Int32Array.from({ length: size + 2 * radius }, (_, i) => beyond(i - radius, size));

  // `kernel` has an odd number of weights; -> Float64Array
  rayproof.alongRows = function (plane, width, height, kernel, beyond) {
    const result = new Float64Array(plane.length);
    const columns = places(width, (kernel.length - 1) / 2, beyond);
    const row = new Float64Array(columns.length);
    for (let y = 0, at = 0; y < height; y += 1) {
      for (let x = 0; x < row.length; x += 1) row[x] = plane[y * width + columns[x]];
      for (let x = 0; x < width; x += 1, at += 1) {
        let sum = 0;
        for (let k = 0; k < kernel.length; k += 1) sum += kernel[k] * row[x + k];
        result[at] = sum;
      }
    }
    return result;
  };

  rayproof.downColumns = function (plane, width, height, kernel, beyond) {
    const result = new Float64Array(plane.length);
    const rows = places(height, (kernel.length - 1) / 2, beyond);
    const column = new Float64Array(rows.length);
    for (let x = 0; x < width; x += 1) {
      for (let y = 0; y < column.length; y += 1) column[y] = plane[rows[y] * width + x];
      for (let y = 0; y < height; y += 1) {
        let sum = 0;
        for (let k = 0; k < kernel.length; k += 1) sum += kernel[k] * column[y + k];
        result[y * width + x] = sum;
      }
    }
    return result;
  };

  // Structural dissimilarity, 1 - SSIM, pixel by pixel: Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from
  // error visibility to structural similarity", IEEE Transactions on Image Processing 13(4), 2004, equation 13.
  const RADIUS = 5, WINDOW = 1.5, K1 = 0.01, K2 = 0.03; // the article's own
  const kernel = rayproof.normalized(rayproof.sampled(RADIUS, (x) => Math.exp(-(x * x) / (2 * WINDOW * WINDOW))));

  // Gaussian blur; at a border the pixels beside it count again, mirrored.
  const blur = (plane, width, height) => rayproof.downColumns(rayproof.alongRows(plane, width, height, kernel, rayproof.mirrored), width, height, kernel, rayproof.mirrored);

  // One channel. Where either image is no number the window is, too: a NaN must never look alike.
  function plane(image, channel, compress) {
    const result = new Float64Array(image.width * image.height);
    for (let i = 0; i < result.length; i += 1) {
      const value = image.values[i * image.channels + channel];
      result[i] = compress ? Math.sign(value) * Math.log1p(Math.abs(value)) : value;
    }
    return result;
  }

  // The range of all finite values of both images, as in `judge/comparison/metrics/structural_similarity.py`.
  function ends(planes) {
    let low = Infinity, high = -Infinity;
    for (const values of planes) for (const value of values) if (Number.isFinite(value)) { low = Math.min(low, value); high = Math.max(high, value); }
    return [low, high];
  }

  function one(a, b, [low, high], width, height) {
    const range = high > low ? high - low : 1;
    const [c1, c2] = [(K1 * range) ** 2, (K2 * range) ** 2];
    // A miss is infinitely far on both sides: as far as anything, and alike.
    const far = (value, other) => (value === other && !Number.isFinite(value) ? high : value);
    const x = a.map((value, i) => far(value, b[i])), y = b.map((value, i) => far(value, a[i]));
    const [mx, my] = [blur(x, width, height), blur(y, width, height)];
    const product = (p, q) => blur(p.map((value, i) => value * q[i]), width, height);
    const [xx, yy, xy] = [product(x, x), product(y, y), product(x, y)];
    return mx.map((m, i) => {
      const [vx, vy, cov] = [xx[i] - m * m, yy[i] - my[i] * my[i], xy[i] - m * my[i]];
      const similar = ((2 * m * my[i] + c1) * (2 * cov + c2)) / ((m * m + my[i] * my[i] + c1) * (vx + vy + c2));
      return Number.isFinite(similar) ? Math.max(0, 1 - similar) : NaN;
    });
  }

  // -> Float64Array of 1 - SSIM, the worst channel's; `compress` takes logarithms of values without an upper end.
  rayproof.dissimilarity = function (ours, theirs, channel, { compress = false } = {}) {
    const { width, height, channels } = ours;
    const result = new Float64Array(width * height);
    const pairs = Array.from({ length: channels }, (_, c) => c).filter((c) => channel < 0 || c === channel)
      .map((c) => [plane(ours, c, compress), plane(theirs, c, compress)]);
    const range = ends(pairs.flat());
    for (const [mine, other] of pairs) {
      const map = one(mine, other, range, width, height);
      map.forEach((value, i) => { if (Number.isNaN(value) || value > result[i]) result[i] = value; });
    }
    return result;
  };

  // Colours as an eye has them, for FLIP: ACES tone mapping (fitted by Narkowicz, 2016), the linear opponent space YCxCz, and
  // CIELAB (D65) with Hunt's adjustment. Constants: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A
  // Difference Evaluator for Alternating Images" (2020), and Andersson et al., "Visualizing Errors in Rendered High Dynamic
  // Range Images" (2021), with their program's numbers.
  // (a x^2 + b x) / (c x^2 + d x + e); the factor 0.6 takes back the exposure that Narkowicz' fit has in it.
  const [A, B, C, D, E] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];
  const clamped = (value) => Math.min(1, Math.max(0, value));
  const toneMapped = (value) => (value > 0 ? clamped((value * (A * value + B)) / (value * (C * value + D) + E)) : 0 * value);

  // The exposure-corrected value that is mapped to `tone`.
  rayproof.toneOrigin = function (tone) {
    const [p, q] = [(B - D * tone) / (A - C * tone) / 2, (E * tone) / (A - C * tone)];
    return -p + Math.sqrt(p * p + q);
  };

  // Linear RGB to XYZ over the white's.
  const TO_XYZ = [
    [10135552, 8788810, 4435075].map((n) => (n / 24577794) * 1.052156925),
    [2613072, 8788810, 887015].map((n) => n / 12288897),
    [1425312, 8788810, 70074185].map((n) => (n / 73733382) * 0.918357670),
  ];
  const [X, Y, Z] = [0.950428545, 1, 1.088900371];
  const TO_RGB = [[3.241003275, -1.537398934, -0.498615861], [-0.969224334, 1.875930071, 0.041554224], [0.055639423, -0.204011202, 1.057148933]]
    .map(([x, y, z]) => [x * X, y * Y, z * Z]);
  const dot = (row, a, b, c) => row[0] * a + row[1] * b + row[2] * c;

  // The planes Y, Cx, Cz of an image that is `gain` times as bright and tone-mapped.
  rayproof.opponent = function ({ width, height, values }, gain) {
    const planes = [0, 1, 2].map(() => new Float64Array(width * height));
    for (let i = 0; i < width * height; i += 1) {
      const r = toneMapped(gain * values[3 * i]), g = toneMapped(gain * values[3 * i + 1]), b = toneMapped(gain * values[3 * i + 2]);
      const x = dot(TO_XYZ[0], r, g, b), y = dot(TO_XYZ[1], r, g, b), z = dot(TO_XYZ[2], r, g, b);
      planes[0][i] = 116 * y - 16;
      planes[1][i] = 500 * (x - y);
      planes[2][i] = 200 * (y - z);
    }
    return planes;
  };

  const root = (value) => (value > (6 / 29) ** 3 ? Math.cbrt(value) : value / (3 * (6 / 29) ** 2) + 4 / 29);

  // [L, a, b] of linear RGB, the colour fading with the lightness (Hunt).
  function adapted(r, g, b) {
    const x = root(dot(TO_XYZ[0], r, g, b)), y = root(dot(TO_XYZ[1], r, g, b)), z = root(dot(TO_XYZ[2], r, g, b));
    const lightness = 116 * y - 16;
    return [lightness, 5 * lightness * (x - y), 2 * lightness * (y - z)];
  }

  // The same of YCxCz, within what a screen can show.
  rayproof.adapted = function (y, cx, cz) {
    const level = (y + 16) / 116;
    const x = level + cx / 500, z = level - cz / 200;
    return adapted(clamped(dot(TO_RGB[0], x, level, z)), clamped(dot(TO_RGB[1], x, level, z)), clamped(dot(TO_RGB[2], x, level, z)));
  };

  // HyAB: how far apart two colours are, also where they are far apart.
  rayproof.apart = (p, q) => Math.abs(p[0] - q[0]) + Math.hypot(p[1] - q[1], p[2] - q[2]);
  rayproof.farthest = rayproof.apart(adapted(0, 1, 0), adapted(0, 0, 1));

  // HDR-FLIP: how different two images of light look when one flips between them, 0 to 1, the worst over all exposures that show
  // something. Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
  // Images" (2020); Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range Images" (2021).
  // `flip_evaluator` by the same authors gives the same; tests hold this against it.
  const DENSITY = 0.7 * (3840 / 0.7) * (Math.PI / 180); // pixels per degree: the authors' 0.7 m wide 4K screen at 0.7 m
  const [QC, PC, PT, QF, WIDTH] = [0.7, 0.4, 0.95, 0.5, 0.082]; // the article's exponents, shares and the width of a feature
  const TONE = 0.85; // of white: where the exposures begin and end
  const MOST = 512 * 512; // pixels: a second for every two exposures, and nobody waits for more

  const { normalized, sampled } = rayproof;

  // What the eye sees of contrast: a Gaussian of Y, of Cx, and two of Cz, [share, b] each.
  const REACH = Math.ceil(3 * Math.sqrt(0.04 / (2 * Math.PI ** 2)) * DENSITY);
  const contrast = (b) => sampled(REACH, (x) => Math.exp((-(Math.PI ** 2) * (x / DENSITY) ** 2) / b));
  const CONTRAST = [[[1, 0.0047]], [[1, 0.0053]], [[34.1, 0.04], [13.5, 0.025]]].map((terms) => {
    const weights = terms.map(([a, b]) => a * Math.sqrt(Math.PI / b) * contrast(b).reduce((sum, w) => sum + w, 0) ** 2);
    const all = weights.reduce((sum, w) => sum + w, 0);
    return terms.map(([, b], i) => ({ share: weights[i] / all, kernel: normalized(contrast(b)) }));
  });

  // Edges and points: the first and second derivative of a Gaussian, what is positive in it summing to 1, and what is negative to -1.
  const SIGMA = 0.5 * WIDTH * DENSITY;
  const bell = (x) => Math.exp(-(x * x) / (2 * SIGMA * SIGMA));
  const balanced = (kernel) => {
    const sum = (sign) => kernel.reduce((total, w) => total + Math.max(0, sign * w), 0);
    const [up, down] = [sum(1), sum(-1)];
    return kernel.map((w) => w / (w > 0 ? up : down));
  };
  const AROUND = Math.ceil(3 * SIGMA);
  const SMOOTH = normalized(sampled(AROUND, bell));
  const FEATURES = [(x) => -x * bell(x), (x) => (x * x / (SIGMA * SIGMA) - 1) * bell(x)].map((of) => balanced(sampled(AROUND, of)));

  const filtered = (plane, width, height, across, down) =>
    rayproof.downColumns(rayproof.alongRows(plane, width, height, across, rayproof.held), width, height, down, rayproof.held);

  function seen(planes, width, height) {
    return planes.map((plane, c) => {
      const sum = new Float64Array(plane.length);
      for (const { share, kernel } of CONTRAST[c]) filtered(plane, width, height, kernel, kernel).forEach((value, i) => { sum[i] += share * value; });
      return sum;
    });
  }

  // How strong an edge, and a point, is at every pixel.
  function features([lightness], width, height) {
    const level = lightness.map((value) => (value + 16) / 116);
    const smooth = rayproof.alongRows(level, width, height, SMOOTH, rayproof.held);
    return FEATURES.map((kernel) => {
      const down = rayproof.downColumns(smooth, width, height, kernel, rayproof.held);
      return filtered(level, width, height, kernel, SMOOTH).map((value, i) => Math.hypot(value, down[i]));
    });
  }

  function atOneExposure(ours, theirs, gain) {
    const { width, height } = ours;
    const [a, b] = [ours, theirs].map((image) => rayproof.opponent(image, gain));
    const [p, q] = [a, b].map((planes) => seen(planes, width, height));
    const [f, g] = [a, b].map((planes) => features(planes, width, height));
    const most = rayproof.farthest ** QC;
    return a[0].map((_, i) => {
      const power = rayproof.apart(rayproof.adapted(p[0][i], p[1][i], p[2][i]), rayproof.adapted(q[0][i], q[1][i], q[2][i])) ** QC;
      const color = power < PC * most ? (PT / (PC * most)) * power : PT + ((power - PC * most) / (most - PC * most)) * (1 - PT);
      const feature = Math.max(Math.abs(f[0][i] - g[0][i]), Math.abs(f[1][i] - g[1][i]));
      return color ** (1 - (feature / Math.SQRT2) ** QF);
    });
  }

  // From that at which the brightest pixel is nearly white to that at which the median is; -> [first, last], in stops. The median
  // is of what is not black: here the background is, and often fills more than half of the image.
  rayproof.exposures = function (image) {
    const luminances = [];
    for (let i = 0; i < image.values.length; i += 3) {
      const value = 0.2126 * image.values[i] + 0.7152 * image.values[i + 1] + 0.0722 * image.values[i + 2];
      if (value > 0 && Number.isFinite(value)) luminances.push(value);
    }
    const sorted = Float64Array.from(luminances).sort();
    const white = rayproof.toneOrigin(TONE);
    return sorted.length ? [sorted.at(-1), sorted[sorted.length >> 1]].map((value) => Math.log2(white / value)) : null;
  };

  // Why there is no FLIP of a stage's images, or null.
  rayproof.noFlip = function (stage, { width, height, channels }) {
    if (!rayproof.hasExposure(stage) || channels !== 3) return "of light only";
    return width * height > MOST ? `of at most ${MOST} pixels` : null;
  };

  // -> Float64Array; where a filter meets a NaN or an infinity there is no FLIP but NaN.
  rayproof.flip = function (ours, theirs, [first, last] = rayproof.exposures(theirs) || rayproof.exposures(ours) || [0, 0]) {
    const count = Math.max(2, Math.ceil(last - first));
    const result = new Float64Array(ours.width * ours.height);
    for (let step = 0; step < count; step += 1) {
      const map = atOneExposure(ours, theirs, 2 ** (first + (step * (last - first)) / (count - 1)));
      map.forEach((value, i) => { if (Number.isNaN(value) || value > result[i]) result[i] = value; });
    }
    return result;
  };

  // Error metrics of two float32 images, in double precision: what float64 NumPy gives for the same floats.
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
    // Whether a pixel's error is that of its worst channel; what decides is the length of the whole difference.
    const each = channel < 0 && ours.channels > 1 && !(metric in MAPS);
    return { metric, width, height, values, worst, smallest, differing, each, at: [at % width, Math.floor(at / width)] };
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
