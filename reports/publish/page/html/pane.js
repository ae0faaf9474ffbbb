// One frame with an image in it: drawn where the shared view says, numbers in the pixels once they are large enough.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const LEGIBLE = 34; // CSS pixels per pixel from which numbers are drawn

  // An image to draw from again and again.
  rayproof.bitmap = function (picture) {
    const canvas = e("canvas", { width: picture.width, height: picture.height });
    canvas.getContext("2d", { willReadFrequently: true }).putImageData(picture, 0, 0);
    return canvas;
  };

  function numbers(context, scene, place, frame) {
    const { image, text } = scene;
    const first = (offset, size) => Math.max(0, Math.floor(-offset / size));
    const last = (offset, size, room, most) => Math.min(most - 1, Math.floor((room - offset) / size));
    context.save();
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.lineJoin = "round";
    const seen = [];
    for (let y = first(place.top, place.scale); y <= last(place.top, place.scale, frame.height, image.height); y += 1) {
      for (let x = first(place.left, place.scale); x <= last(place.left, place.scale, frame.width, image.width); x += 1) seen.push([x, y, text(x, y)]);
    }
    // One size for all: as large as the longest number and the most lines allow.
    const most = (measure) => seen.reduce((sum, [, , lines]) => Math.max(sum, measure(lines)), 1);
    const longest = most((lines) => Math.max(...lines.map((line) => line.length)));
    const size = Math.min(15, place.scale / (most((lines) => lines.length) + 0.6), (1.6 * place.scale) / longest);
    context.font = `${size}px ui-monospace, Menlo, Consolas, "DejaVu Sans Mono", monospace`;
    context.strokeStyle = "rgba(0, 0, 0, 0.85)";
    context.lineWidth = size / 4;
    context.fillStyle = "#fff";
    for (const [x, y, lines] of size < 5 ? [] : seen) {
      lines.forEach((line, i) => {
        const [px, py] = [place.left + (x + 0.5) * place.scale, place.top + (y + 0.5) * place.scale + (i - (lines.length - 1) / 2) * size * 1.1];
        context.strokeText(line, px, py);
        context.fillText(line, px, py);
      });
    }
    context.restore();
  }

  function cursor(context, place, [x, y]) {
    const size = Math.max(place.scale, 5);
    const [left, top] = [place.left + (x + 0.5) * place.scale - size / 2, place.top + (y + 0.5) * place.scale - size / 2];
    context.lineWidth = 3;
    context.strokeStyle = "#000";
    context.strokeRect(left - 0.5, top - 0.5, size + 1, size + 1);
    context.lineWidth = 1.25;
    context.strokeStyle = "#fff";
    context.strokeRect(left - 0.5, top - 0.5, size + 1, size + 1);
  }

  // -> {node, canvas, frame(), draw(scene)}; a scene is {image: {width, height}, view, layers: [{bitmap, alpha, from, to}],
  // text(x, y) -> lines, pixel}. `from` and `to` clip a layer to a part of the frame's width.
  rayproof.pane = function (label) {
    const canvas = e("canvas", { tabindex: "0", role: "application", "aria-roledescription": "image", "aria-label": label });
    const title = e("strong");
    const note = e("span", { class: "muted" });
    const foot = e("div", { class: "pane-foot" });
    const node = e("figure", { class: "pane" }, e("figcaption", {}, title, " ", note), e("div", { class: "frame" }, canvas), foot);
    const frame = () => ({ width: canvas.clientWidth || 300, height: canvas.clientHeight || 225 });

    function draw(scene) {
      const room = frame();
      const density = window.devicePixelRatio || 1;
      const [width, height] = [Math.round(room.width * density), Math.round(room.height * density)];
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      const context = canvas.getContext("2d", { willReadFrequently: true });
      context.setTransform(density, 0, 0, density, 0, 0);
      context.clearRect(0, 0, room.width, room.height);
      const place = rayproof.placed(scene.view, scene.image, room);
      for (const { bitmap, alpha = 1, from = 0, to = 1 } of scene.layers) {
        context.save();
        context.globalAlpha = alpha;
        if (from > 0 || to < 1) {
          context.beginPath();
          context.rect(from * room.width, 0, (to - from) * room.width, room.height);
          context.clip();
        }
        // Pixels stay squares when magnified; an image larger than its frame is averaged.
        context.imageSmoothingEnabled = place.scale * density < 1;
        context.drawImage(bitmap, place.left, place.top, scene.image.width * place.scale, scene.image.height * place.scale);
        context.restore();
      }
      if (place.scale >= LEGIBLE && scene.text) numbers(context, scene, place, room);
      if (scene.divider !== undefined) {
        context.fillStyle = "#fff";
        context.fillRect(scene.divider * room.width - 1, 0, 2, room.height);
      }
      if (scene.pixel) cursor(context, place, scene.pixel);
      canvas.layers = scene.layers;
    }

    const caption = (name, more) => { rayproof.replace(title, name); rayproof.replace(note, more); };
    return { node, canvas, foot, frame, draw, caption };
  };
})(window.rayproof);
