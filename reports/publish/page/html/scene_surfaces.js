// The specification's shapes as surfaces of polygons in world space: what reports/publish/scene3d/surfaces.py makes,
// of the same numbers. Vectors are arrays of three, matrices arrays of rows.
(function (rayproof) {
  "use strict";

  const IDENTITY = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]];
  const CUBE_SIDES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

  const vector = {
    dot: (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
    cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
    minus: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
    along: (from, direction, length) => [from[0] + length * direction[0], from[1] + length * direction[1], from[2] + length * direction[2]],
    length: (a) => Math.sqrt(vector.dot(a, a)),
    unit: (a) => { const length = vector.length(a); return [a[0] / length, a[1] / length, a[2] / length]; },
  };
  rayproof.vector = vector;

  // Rows of the inverse of an affine matrix's upper 3 x 3, and its determinant.
  function inverted(matrix) {
    const [a, b, c] = matrix.slice(0, 3).map((row) => row.slice(0, 3));
    const columns = [vector.cross(b, c), vector.cross(c, a), vector.cross(a, b)];
    const determinant = vector.dot(a, columns[0]);
    return { determinant, rows: [0, 1, 2].map((i) => columns.map((column) => column[i] / determinant)) };
  }

  // The q quantile of numbers, linear between two of them.
  function quantile(sorted, q) {
    const place = q * (sorted.length - 1), low = Math.floor(place), high = Math.min(low + 1, sorted.length - 1);
    return sorted[low] + (place - low) * (sorted[high] - sorted[low]);
  }
  // -> per axis of points the 5 % and the 95 % quantile
  rayproof.middleOf = (points, axes) => Array.from({ length: axes }, (_, axis) => {
    const sorted = Float64Array.from(points, (point) => point[axis]).sort();
    return [quantile(sorted, 0.05), quantile(sorted, 0.95)];
  });

  // The unit sphere by `around` meridians and half as many circles of latitude; its points are its normals.
  rayproof.ball = function (around) {
    const rings = around / 2, points = [], cells = [];
    for (let ring = 0; ring <= rings; ring += 1) {
      const theta = (Math.PI * ring) / rings;
      for (let place = 0; place < around; place += 1) {
        const phi = (2 * Math.PI * place) / around;
        points.push([Math.sin(theta) * Math.cos(phi), Math.sin(theta) * Math.sin(phi), Math.cos(theta)]);
        const here = ring * around + place, beside = ring * around + ((place + 1) % around);
        if (ring < rings) cells.push([here, here + around, beside + around, beside]);
      }
    }
    return { points, cells };
  };

  // Where a plane is drawn, in its own space: below those points that lie on it, else below all.
  function patchOf(matrix, inverse, patch, margin) {
    const offset = matrix.slice(0, 3).map((row) => row[3]);
    const local = patch.map((point) => inverse.map((row) => vector.dot(row, vector.minus(point, offset))));
    let largest = 1;
    for (const point of local) for (const value of point) largest = Math.max(largest, Math.abs(value));
    const on = local.filter((point) => Math.abs(point[2]) < 1e-3 * largest);
    return rayproof.middleOf(on.length ? on : local, 2).map(([low, high], axis) => {
      const scale = vector.length(matrix.slice(0, 3).map((row) => row[axis]));
      return [low - margin / scale, high + margin / scale];
    });
  }

  const rectangle = ([[x0, x1], [y0, y1]]) => ({ points: [[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]], cells: [[0, 1, 2, 3]] });
  const soup = (corners) => ({ points: corners, cells: Array.from({ length: corners.length / 3 }, (_, i) => [3 * i, 3 * i + 1, 3 * i + 2]) });

  // -> {points: [[x, y, z]], cells: [[number of a point, ...]], normals: [[x, y, z]] or null}; of a plane, around the
  // points `patch`, `margin` [m] wider.
  rayproof.surface = function (shape, { around, patch, margin }) {
    const matrix = shape.to_world || IDENTITY;
    const place = (p) => [0, 1, 2].map((i) => vector.dot(matrix[i], p) + matrix[i][3]);
    const placed = ({ points, cells }, normals = null) => ({ points: points.map(place), cells, normals });
    if (shape.type === "sphere") {
      const { points, cells } = rayproof.ball(around);
      const { determinant, rows } = inverted(matrix);
      const center = shape.center || [0, 0, 0], radius = shape.radius ?? 1;
      // By the inverse transpose; a mirrored ball would turn its dark side to whoever looks.
      const normals = points.map((n) => vector.unit([0, 1, 2].map((i) => n[0] * rows[0][i] + n[1] * rows[1][i] + n[2] * rows[2][i])));
      return placed({ points: points.map((n) => vector.along(center, n, radius)), cells: determinant > 0 ? cells : cells.map((cell) => [...cell].reverse()) }, normals);
    }
    if (shape.type === "cube") {
      return placed({ points: Array.from({ length: 8 }, (_, i) => [0, 1, 2].map((axis) => ((i >> axis) & 1) - 0.5)), cells: CUBE_SIDES });
    }
    if (shape.type === "square") return placed(rectangle([[-0.5, 0.5], [-0.5, 0.5]]));
    if (shape.type === "plane") return placed(rectangle(patchOf(matrix, inverted(matrix).rows, patch, margin)));
    if (shape.type === "triangle") return placed(soup(shape.vertices));
    if (shape.type === "mesh") return placed(soup(shape.faces.flat().map((vertex) => shape.vertices[vertex])));
    throw new Error(`there is no shape of type ${shape.type}`);
  };
})(window.rayproof);
