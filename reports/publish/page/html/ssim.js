// Structural dissimilarity, 1 - SSIM, pixel by pixel: Wang, Bovik, Sheikh and Simoncelli, "Image quality assessment: from
// error visibility to structural similarity", IEEE Transactions on Image Processing 13(4), 2004, equation 13.
(function (rayproof) {
  "use strict";

  const RADIUS = 5, SIGMA = 1.5, K1 = 0.01, K2 = 0.03; // the article's own
  const kernel = rayproof.normalized(rayproof.sampled(RADIUS, (x) => Math.exp(-(x * x) / (2 * SIGMA * SIGMA))));

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
})(window.rayproof);
