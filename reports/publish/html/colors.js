// Colour tables that read without colour vision: viridis (van der Walt and Smith, 2015) sampled at 16 places; tab10-like
// colours in varying lightness for indices; the sRGB transfer curve (IEC 61966-2-1) as a table.
(function (rayproof) {
  "use strict";

  const STOPS = [
    [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142],
    [35, 136, 142], [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54],
    [210, 226, 27], [253, 231, 37],
  ];
  const SIZE = 1024;
  const viridis = new Uint8Array(3 * SIZE);
  for (let i = 0; i < SIZE; i += 1) {
    const place = (i / (SIZE - 1)) * (STOPS.length - 1);
    const low = Math.min(STOPS.length - 2, Math.floor(place));
    for (let c = 0; c < 3; c += 1) {
      viridis[3 * i + c] = Math.round(STOPS[low][c] + (place - low) * (STOPS[low + 1][c] - STOPS[low][c]));
    }
  }
  // -> offset of a value in [0, 1] into the table
  rayproof.viridis = { table: viridis, at: (value) => 3 * Math.round(Math.min(1, Math.max(0, value)) * (SIZE - 1)) };

  const srgb = new Uint8Array(4096);
  for (let i = 0; i < 4096; i += 1) {
    const value = i / 4095;
    srgb[i] = Math.round(255 * (value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055));
  }
  rayproof.srgb = (value) => srgb[value <= 0 ? 0 : value >= 1 ? 4095 : (value * 4095 + 0.5) | 0];

  const INDEX = [
    [86, 180, 233], [230, 159, 0], [0, 158, 115], [204, 121, 167], [240, 228, 66], [0, 114, 178], [213, 94, 0],
    [153, 153, 153],
  ];
  // An index's colour: Okabe and Ito's eight, darker each time round.
  rayproof.indexColor = (index) => INDEX[index % 8].map((value) => value * 0.8 ** (Math.floor(index / 8) % 6));

  rayproof.NAN = [255, 0, 255];
  rayproof.INFINITE = [0, 255, 255];
  rayproof.MISS = [58, 62, 68];
})(window.rayproof);
