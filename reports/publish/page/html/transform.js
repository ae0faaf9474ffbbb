// Where an image lies in its frame: zoom 1 fits it in, (x, y) is the image point in the frame's middle.
(function (rayproof) {
  "use strict";

  const MOST = 120; // CSS pixels per image pixel: numbers of nine digits fit in

  // -> {scale: CSS pixels per image pixel, left, top: of the image's corner in the frame}
  rayproof.placed = function (view, image, frame) {
    const scale = view.zoom * Math.min(frame.width / image.width, frame.height / image.height);
    return { scale, left: frame.width / 2 - view.x * scale, top: frame.height / 2 - view.y * scale };
  };

  // -> the image point under a point of the frame
  rayproof.under = function (view, image, frame, [px, py]) {
    const { scale, left, top } = rayproof.placed(view, image, frame);
    return [(px - left) / scale, (py - top) / scale];
  };

  // Zoom so that what is under a point of the frame stays there; never smaller than fitting, never past the largest.
  rayproof.zoomed = function (view, image, frame, factor, [px, py]) {
    const fit = Math.min(frame.width / image.width, frame.height / image.height);
    const zoom = Math.min(Math.max(1, MOST / fit), Math.max(1, view.zoom * factor));
    const [x, y] = rayproof.under(view, image, frame, [px, py]);
    const scale = zoom * fit;
    return rayproof.kept({ zoom, x: x - (px - frame.width / 2) / scale, y: y - (py - frame.height / 2) / scale }, image, frame);
  };

  // The view moved as little as needed for the frame to show nothing but image, or all of it.
  rayproof.kept = function (view, image, frame) {
    const { scale } = rayproof.placed(view, image, frame);
    const clamp = (value, size, room) => {
      const half = Math.min(size / 2, room / 2 / scale);
      return Math.min(size - half, Math.max(half, value));
    };
    return { zoom: view.zoom, x: clamp(view.x, image.width, frame.width), y: clamp(view.y, image.height, frame.height) };
  };

  rayproof.fitted = (image) => ({ zoom: 1, x: image.width / 2, y: image.height / 2 });

  // The zoom at which a pixel is `size` CSS pixels wide.
  rayproof.zoomFor = (size, image, frame) => Math.max(1, size / Math.min(frame.width / image.width, frame.height / image.height));
})(window.rayproof);
