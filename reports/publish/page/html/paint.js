// A stage's floats as colours. Radiometric stages: exposure, then sRGB or a gamma. Directions: [-1, 1] to [0, 1].
// Distances and positions: their range. Indices: a colour each. NaN is magenta, an infinity cyan, a miss's distance grey.
(function (rayproof) {
  "use strict";
  const SIGNED = new Set(["ray", "normal"]);
  const LIGHT = new Set(["irradiance", "exitance", "radiance", "colour"]);
  rayproof.hasExposure = (stage) => LIGHT.has(stage);

  // What both images are shown by, taken from the reference (or ours where there is none).
  rayproof.scaleOf = function (stage, image) {
    const finite = [];
    const ranges = Array.from({ length: image.channels }, () => [Infinity, -Infinity]);
    for (let i = 0; i < image.values.length; i += 1) {
      const value = image.values[i];
      if (!Number.isFinite(value)) continue;
      const range = ranges[i % image.channels];
      if (value < range[0]) range[0] = value;
      if (value > range[1]) range[1] = value;
      if (value > 0 && LIGHT.has(stage)) finite.push(value);
    }
    const sorted = Float32Array.from(finite).sort();
    // White is what all but the brightest hundredth stay below.
    return { ranges, white: sorted.length ? sorted[Math.floor(0.99 * (sorted.length - 1))] : 1 };
  };

  // -> ImageData. `map` names a colour map for one number per pixel, or is "" for the stage's own colours.
  rayproof.paint = function (stage, image, scale, { channel = -1, exposure = 0, gamma = 0, map = "" } = {}) {
    const { width, height, channels, values } = image;
    const picture = new ImageData(width, height);
    const tone = toneOf(stage, scale, 2 ** exposure / scale.white, map ? 1 : gamma);
    const [from, to] = channel < 0 ? [0, channels] : [channel, channel + 1];
    for (let pixel = 0, at = 0; pixel < width * height; pixel += 1, at += 4) {
      const start = pixel * channels;
      const color = special(stage, values, start + from, start + to)
        || (map && stage !== "object" ? falseColor(map, stage, values, start, from, to, tone)
          : ownColor(stage, values, start, channels, channel, tone));
      picture.data[at] = color[0];
      picture.data[at + 1] = color[1];
      picture.data[at + 2] = color[2];
      picture.data[at + 3] = 255;
    }
    return picture;
  };

  function toneOf(stage, scale, gain, gamma) {
    if (SIGNED.has(stage)) return (value) => 127.5 * (1 + value);
    if (LIGHT.has(stage)) {
      const curve = rayproof.toneCurve(gamma);
      return (value) => curve(value * gain);
    }
    if (stage === "visibility") return (value) => 30 + 210 * value;
    return (value, c) => {
      const [low, high] = scale.ranges[c] || [0, 1];
      return 255 * (high > low ? (value - low) / (high - low) : 0.5);
    };
  }

  function special(stage, values, from, to) {
    for (let i = from; i < to; i += 1) if (Number.isNaN(values[i])) return rayproof.NAN;
    for (let i = from; i < to; i += 1) {
      if (!Number.isFinite(values[i])) return stage === "distance" && values[i] > 0 ? rayproof.MISS : rayproof.INFINITE;
    }
    return null;
  }

  // One number: the chosen channel, or the mean of all.
  function falseColor(map, stage, values, start, from, to, tone) {
    let sum = 0;
    for (let c = from; c < to; c += 1) sum += tone(values[start + c], c) / (to - from);
    return rayproof.mapped(map, sum / 255);
  }

  function ownColor(stage, values, start, channels, channel, tone) {
    if (stage === "object") {
      const index = values[start + (channel < 0 ? 0 : channel)];
      return index < 0 ? rayproof.MISS : rayproof.indexColor(Math.floor(index));
    }
    if (stage === "distance") return rayproof.mapped("viridis", 1 - tone(values[start], 0) / 255);
    if (channel >= 0) {
      const grey = tone(values[start + channel], channel);
      return [grey, grey, grey];
    }
    if (channels === 3) return [tone(values[start], 0), tone(values[start + 1], 1), tone(values[start + 2], 2)];
    let sum = 0;
    for (let c = 0; c < channels; c += 1) sum += tone(values[start + c], c) / channels;
    return [sum, sum, sum];
  }

  // Errors as colours: black where there is none. -> ImageData
  rayproof.paintErrors = function (errors, range, log, map) {
    const picture = new ImageData(errors.width, errors.height);
    const signed = rayproof.isSigned(errors.metric);
    errors.values.forEach((value, pixel) => {
      let color = rayproof.NOTHING;
      if (Number.isNaN(value)) color = rayproof.NAN;
      else if (!Number.isFinite(value)) color = rayproof.INFINITE;
      else if (value !== 0) {
        const place = Math.min(1, Math.max(0, rayproof.position(value, range, log)));
        color = signed ? rayproof.mapped("signed", 0.5 + 0.5 * Math.sign(value) * place) : rayproof.mapped(map, place);
      }
      picture.data.set([color[0], color[1], color[2], 255], 4 * pixel);
    });
    return picture;
  };

  // The judge's classes of pixels over an image: silhouettes, shadow edges, terminators. A colour and a letter each.
  // By bit of the mask, as in reports/judge/edge_classes.py.
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

  // How often which error occurs, on the scale of the colour bar; the limit is a line, what lies beyond it hatched.
  const e = rayproof.element;

  // -> {bins: [count], zero, below, above, odd: NaN and infinities}
  rayproof.histogram = function (errors, range, log, count = 48) {
    const bins = new Array(count).fill(0);
    let zero = 0, below = 0, above = 0, odd = 0;
    for (const value of errors.values) {
      if (!Number.isFinite(value)) odd += 1;
      else if (value === 0 && log) zero += 1;
      else {
        const place = rayproof.position(value, range, log);
        if (place < 0) below += 1;
        else if (place > 1) above += 1;
        else bins[Math.min(count - 1, Math.floor(place * count))] += 1;
      }
    }
    return { bins, zero, below, above, odd };
  };

  const WIDTH = 480, HEIGHT = 90;
  const { svg } = rayproof;

  // `limit` is null where the limit is of another quantity than the metric shown.
  rayproof.histogramView = function (errors, range, log, limit) {
    const { bins, zero, below, above, odd } = rayproof.histogram(errors, range, log);
    const top = Math.log1p(Math.max(1, ...bins));
    const wide = WIDTH / bins.length;
    const at = limit === null ? null : rayproof.position(limit, range, log);
    const shown = at !== null && at >= 0 && at <= 1;
    const bars = bins.map((number, i) => {
      const high = (Math.log1p(number) / top) * HEIGHT;
      const over = at !== null && i / bins.length >= at;
      return number ? svg("rect", { x: i * wide + 0.5, y: HEIGHT - high, width: wide - 1, height: high, class: over ? "bin over" : "bin" }) : null;
    });
    const said = [zero && `${zero} without error`, below && `${below} below the range`, above && `${above} above it`,
      odd && `${odd} NaN or infinite`].filter(Boolean).join(", ");
    const beyond = limit === null ? null : errors.values.reduce((sum, value) => sum + !(Math.abs(value) <= limit), 0);
    const words = beyond === null ? "" : beyond ? `${beyond} pixels beyond the limit at its worst pixel, ${rayproof.short(limit)}`
      : `no pixel beyond the limit at its worst pixel, ${rayproof.short(limit)}`;
    return e("figure", { class: "histogram" },
      svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img",
        "aria-label": `Histogram of ${errors.metric} errors; ${words || "no limit of this quantity"}` },
      bars, shown ? svg("line", { x1: at * WIDTH, x2: at * WIDTH, y1: 0, y2: HEIGHT, class: "limit" }) : null),
      e("figcaption", { class: "muted" }, [`${errors.values.length} pixels, counts on a log scale`, said, words].filter(Boolean).join(" \u00B7 ")));
  };
})(window.rayproof);
