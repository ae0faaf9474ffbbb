// HDR-FLIP: how different two images of light look when one flips between them, 0 to 1, the worst over all exposures that show
// something. Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for Alternating
// Images" (2020); Andersson, Nilsson, Shirley and Akenine-Möller, "Visualizing Errors in Rendered High Dynamic Range Images" (2021).
// `flip_evaluator` by the same authors gives the same; tests hold this against it.
(function (rayproof) {
  "use strict";

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
})(window.rayproof);
