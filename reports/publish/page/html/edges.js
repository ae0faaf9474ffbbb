// The judge's classes of pixels over an image: silhouettes, shadow edges, terminators. A colour and a letter each.
(function (rayproof) {
  "use strict";

  // By bit of the mask, as in reports/judge/tolerance/edge_mask.py.
  const KINDS = [
    [1, "silhouette", "S", [230, 159, 0]], [2, "shadow edge", "H", [86, 180, 233]],
    [4, "terminator", "T", [240, 228, 66]], [8, "light on the surface", "L", [204, 121, 167]],
  ];
  rayproof.edgeKinds = KINDS.map(([bit, name, letter, color]) => ({ bit, name, letter, color }));

  // -> the kinds of one pixel
  rayproof.kindsAt = (mask, width, x, y) => (mask ? rayproof.edgeKinds.filter(({ bit }) => mask[y * width + x] & bit) : []);

  // -> ImageData, see-through where pixels are judged strictly
  rayproof.paintEdges = function (mask, width, height) {
    const picture = new ImageData(width, height);
    mask.forEach((bits, pixel) => {
      const kind = rayproof.edgeKinds.find(({ bit }) => bits & bit);
      if (kind) picture.data.set([...kind.color, 215], 4 * pixel);
    });
    return picture;
  };

  rayproof.edgeCounts = (mask) => rayproof.edgeKinds.map((kind) => ({ ...kind, count: mask.reduce((sum, bits) => sum + ((bits & kind.bit) > 0), 0) }))
    .filter(({ count }) => count);
})(window.rayproof);
