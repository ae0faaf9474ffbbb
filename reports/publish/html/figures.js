// Reference, ours and their difference side by side, one pixel marked in all of them.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  function figure(title, note, picture, label) {
    const canvas = e("canvas", { width: picture.width, height: picture.height, tabindex: "0", role: "img", "aria-label": label });
    // Drawn once and seldom: kept in plain memory, which every machine draws alike.
    canvas.getContext("2d", { willReadFrequently: true }).putImageData(picture, 0, 0);
    const cursor = e("div", { class: "cursor", hidden: true });
    const frame = e("div", { class: "frame" }, canvas, cursor);
    return { canvas, cursor, node: e("figure", {}, e("figcaption", {}, e("strong", {}, title), " ",
      e("span", { class: "muted" }, note)), frame) };
  }

  function absent(title, why) {
    return { canvas: null, node: e("figure", {}, e("figcaption", {}, e("strong", {}, title)),
      e("div", { class: "frame absent" }, why)) };
  }

  function bar(difference, scale, unit) {
    const canvas = e("canvas", { width: 256, height: 1, class: "colorbar", "aria-hidden": "true" });
    const context = canvas.getContext("2d");
    const picture = context.createImageData(256, 1);
    for (let i = 0; i < 256; i += 1) {
      const start = rayproof.viridis.at(i / 255);
      picture.data.set([...rayproof.viridis.table.subarray(start, start + 3), 255], 4 * i);
    }
    context.putImageData(picture, 0, 0);
    return e("div", { class: "scale" }, canvas,
      e("span", {}, rayproof.short(10 ** scale.low, 2)), e("span", { class: "muted" }, unit),
      e("span", {}, rayproof.short(10 ** scale.top, 2)));
  }

  // -> {node, mark(x, y)}; onpixel(x, y) is told which pixel is pointed at.
  rayproof.figures = function ({ stage, unit, ours, theirs, names, view, metric, why, onpixel }) {
    const basis = theirs || ours;
    const scale = rayproof.scaleOf(stage, basis);
    const options = { channel: view.channel, exposure: view.exposure };
    const shown = rayproof.hasExposure(stage) ? `white = ${rayproof.short(scale.white / 2 ** view.exposure)} ${unit}` : range(stage, scale, unit);
    const parts = [
      theirs ? figure("reference", `${names.theirs} \u00B7 ${shown}`, rayproof.paint(stage, theirs, scale, options), `${stage}, reference`)
        : absent("reference", why.theirs),
      ours ? figure("ours", names.ours, rayproof.paint(stage, ours, scale, options), `${stage}, ours`) : absent("ours", why.ours),
    ];
    if (ours && theirs && ours.width === theirs.width && ours.height === theirs.height && ours.channels === theirs.channels) {
      const difference = rayproof.difference(metric, ours, theirs, view.channel);
      const range = rayproof.differenceScale(difference, view.gain);
      const total = difference.values.length;
      const note = difference.differing ? `worst ${rayproof.short(difference.worst)} at ${difference.at.join(", ")} \u00B7 ${difference.differing} of ${total} pixels differ`
        : "not one pixel differs";
      const part = figure(`${metric} difference`, note, rayproof.paintDifference(difference, range), `${stage}, difference`);
      part.node.append(bar(difference, range, metric === "absolute" ? unit : metric === "ulp" ? "ulp" : "relative"));
      parts.push(part);
    } else {
      parts.push(absent("difference", ours && theirs ? "The images differ in size." : "There is nothing to compare."));
    }
    let place = [0, 0];
    const { width, height } = basis;

    function mark(x, y) {
      place = [Math.min(width - 1, Math.max(0, x)), Math.min(height - 1, Math.max(0, y))];
      for (const part of parts) {
        if (!part.canvas) continue;
        part.cursor.hidden = false;
        Object.assign(part.cursor.style, { left: `${(100 * place[0]) / width}%`, top: `${(100 * place[1]) / height}%`,
          width: `${100 / width}%`, height: `${100 / height}%` });
      }
    }

    function point(x, y) {
      mark(x, y);
      onpixel(...place);
    }

    for (const { canvas } of parts) {
      if (!canvas) continue;
      const under = (event) => {
        const box = canvas.getBoundingClientRect();
        point(Math.floor(((event.clientX - box.left) / box.width) * width),
          Math.floor(((event.clientY - box.top) / box.height) * height));
      };
      canvas.addEventListener("pointermove", under);
      canvas.addEventListener("pointerdown", under);
      canvas.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
        if (!step) return;
        event.preventDefault();
        point(place[0] + step[0], place[1] + step[1]);
      });
    }
    return { node: e("div", { class: "figures" }, parts.map((part) => part.node)), mark: point };
  };

  function range(stage, scale, unit) {
    if (stage !== "distance") return "";
    const [low, high] = scale.ranges[0];
    return low <= high ? `${rayproof.short(low)} to ${rayproof.short(high)} ${unit}` : "no hit";
  }
})(window.rayproof);
