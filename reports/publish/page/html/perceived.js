// Colours as an eye has them, for FLIP: ACES tone mapping (fitted by Narkowicz, 2016), the linear opponent space YCxCz, and
// CIELAB (D65) with Hunt's adjustment. Constants: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A
// Difference Evaluator for Alternating Images" (2020), and Andersson et al., "Visualizing Errors in Rendered High Dynamic
// Range Images" (2021), with their program's numbers.
(function (rayproof) {
  "use strict";

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
})(window.rayproof);
