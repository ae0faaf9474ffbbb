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
})(window.rayproof);
