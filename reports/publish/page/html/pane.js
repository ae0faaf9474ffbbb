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

  // One frame with an image in it: drawn where the shared view says, numbers in the pixels once they are large enough.
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

  // Pointing, dragging, the wheel and arrow keys on a pane: one pixel and one view, shared by all panes.
  const CLICK = 4; // CSS pixels that a hand may shake

  // `shared` is {image, view, pixel, pinned}; change() redraws, point(x, y) tells which pixel is meant.
  rayproof.pointing = function (pane, shared, { change, point }) {
    const { canvas } = pane;
    const fingers = new Map();
    let start = null;

    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    const look = (view) => { shared.view = view; change(); };
    const zoom = (factor, at) => look(rayproof.zoomed(shared.view, shared.image, pane.frame(), factor, at));

    function hover(event) {
      const [x, y] = rayproof.under(shared.view, shared.image, pane.frame(), place(event)).map(Math.floor);
      if (x >= 0 && y >= 0 && x < shared.image.width && y < shared.image.height) point(x, y);
    }

    canvas.addEventListener("pointerdown", (event) => {
      fingers.set(event.pointerId, place(event));
      canvas.setPointerCapture(event.pointerId);
      start = { at: place(event), view: shared.view, moved: fingers.size > 1 };
    });
    canvas.addEventListener("pointermove", (event) => {
      const held = fingers.get(event.pointerId);
      if (!held) {
        if (!shared.pinned) hover(event);
        return;
      }
      const now = place(event);
      const other = [...fingers].find(([id]) => id !== event.pointerId);
      if (other) { // two fingers: pinch
        const apart = ([ax, ay], [bx, by]) => Math.hypot(ax - bx, ay - by) || 1;
        const middle = [(now[0] + other[1][0]) / 2, (now[1] + other[1][1]) / 2];
        zoom(apart(now, other[1]) / apart(held, other[1]), middle);
      } else if (start && (start.moved || Math.hypot(now[0] - start.at[0], now[1] - start.at[1]) > CLICK)) {
        start.moved = true;
        const { scale } = rayproof.placed(start.view, shared.image, pane.frame());
        look(rayproof.kept({ ...start.view, x: start.view.x - (now[0] - start.at[0]) / scale, y: start.view.y - (now[1] - start.at[1]) / scale },
          shared.image, pane.frame()));
      }
      fingers.set(event.pointerId, now);
    });
    const release = (event) => {
      fingers.delete(event.pointerId);
      if (start && !start.moved && event.type === "pointerup") {
        shared.pinned = false;
        hover(event);
        shared.pinned = true;
        change();
      }
      if (!fingers.size) start = null;
    };
    canvas.addEventListener("pointerup", release);
    canvas.addEventListener("pointercancel", release);
    canvas.addEventListener("dblclick", (event) => zoom(2, place(event)));
    // Only where the pane was chosen: a page must still scroll past an image.
    canvas.addEventListener("wheel", (event) => {
      if (!event.ctrlKey && document.activeElement !== canvas) return;
      event.preventDefault();
      zoom(2 ** (-event.deltaY / (event.deltaMode ? 8 : 240)), place(event));
    }, { passive: false });
    canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
      if (!step || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      const [x, y] = shared.pixel || [0, 0];
      const stride = event.shiftKey ? 10 : 1;
      const clamp = (value, size) => Math.min(size - 1, Math.max(0, value));
      shared.pinned = true;
      point(clamp(x + stride * step[0], shared.image.width), clamp(y + stride * step[1], shared.image.height));
    });
  };
})(window.rayproof);
