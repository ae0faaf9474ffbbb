// Colour tables that read without colour vision: viridis (van der Walt and Smith, 2015), cividis (Nuñez, Anderton and
// Renslow, 2018), grey, and for signed errors blue over white to orange; Okabe and Ito's eight for indices; the sRGB
// transfer curve (IEC 61966-2-1).
(function (rayproof) {
  "use strict";

  const STOPS = {
    viridis: [
      [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
      [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
      [210, 226, 27], [253, 231, 37],
    ],
    cividis: [
      [0, 34, 78], [0, 48, 111], [42, 63, 108], [69, 78, 107], [91, 93, 110], [111, 109, 114], [130, 126, 120],
      [152, 143, 119], [175, 161, 113], [199, 180, 104], [224, 200, 88], [254, 232, 56],
    ],
    grey: [[0, 0, 0], [255, 255, 255]],
    signed: [[8, 48, 107], [33, 113, 181], [107, 174, 214], [198, 219, 239], [247, 247, 247], [253, 208, 162],
      [253, 141, 60], [217, 72, 1], [127, 39, 4]],
  };
  const SIZE = 1024;

  function tableOf(stops) {
    const table = new Uint8Array(3 * SIZE);
    for (let i = 0; i < SIZE; i += 1) {
      const place = (i / (SIZE - 1)) * (stops.length - 1);
      const low = Math.min(stops.length - 2, Math.floor(place));
      for (let c = 0; c < 3; c += 1) {
        table[3 * i + c] = Math.round(stops[low][c] + (place - low) * (stops[low + 1][c] - stops[low][c]));
      }
    }
    return table;
  }

  const TABLES = Object.fromEntries(Object.entries(STOPS).map(([name, stops]) => [name, tableOf(stops)]));
  rayproof.colorMaps = ["viridis", "cividis", "grey"];
  // -> the colour [r, g, b] of a value in [0, 1]
  rayproof.mapped = function (name, value) {
    const start = 3 * Math.round(Math.min(1, Math.max(0, value)) * (SIZE - 1));
    const table = TABLES[name];
    return [table[start], table[start + 1], table[start + 2]];
  };

  const curves = new Map();
  // A table of 4096 places over [0, 1]: sRGB's curve, or 1 / gamma.
  function curve(gamma) {
    if (!curves.has(gamma)) {
      curves.set(gamma, Uint8Array.from({ length: 4096 }, (_, i) => {
        const value = i / 4095;
        if (gamma) return Math.round(255 * value ** (1 / gamma));
        return Math.round(255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055));
      }));
    }
    return curves.get(gamma);
  }
  // -> a function from a linear value to [0, 255]; gamma 0 means sRGB
  rayproof.toneCurve = function (gamma) {
    const table = curve(gamma);
    return (value) => table[value <= 0 ? 0 : value >= 1 ? 4095 : (value * 4095 + 0.5) | 0];
  };

  const INDEX = [
    [86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [0, 114, 178], [213, 94, 0],
    [153, 153, 153],
  ];
  // An index's colour, darker each time round.
  rayproof.indexColor = (index) => INDEX[index % 8].map((value) => value * 0.8 ** (Math.floor(index / 8) % 6));

  rayproof.NAN = [255, 0, 255];
  rayproof.INFINITE = [0, 255, 255];
  rayproof.MISS = [58, 62, 68];
  rayproof.NOTHING = [12, 12, 16];
})(window.rayproof);
