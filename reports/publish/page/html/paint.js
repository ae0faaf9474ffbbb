// Images as colours on a canvas.
(function (rayproof) {
  "use strict";

  // Colour tables that read without colour vision: viridis (van der Walt and Smith, 2015), cividis (Nuñez, Anderton and
  // Renslow, 2018), grey, and for signed errors blue over white to orange; Okabe and Ito's eight for indices; the sRGB
  // transfer curve (IEC 61966-2-1).

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

  // A stage's floats as colours. Radiometric stages: exposure, then sRGB or a gamma. Directions: [-1, 1] to [0, 1].
  // Distances and positions: their range. Indices: a colour each. NaN is magenta, an infinity cyan, a miss's distance grey.

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

  // The pixels over their limits whose values are explained, over an image: a colour and a letter for each explanation.
  // By the value of the mask in a case's record.
  const EXPLANATIONS = [[1, "explained by rounding", "R", [230, 159, 0]], [2, "explained by a declared epsilon", "E", [86, 180, 233]]];
  rayproof.explanations = EXPLANATIONS.map(([code, name, letter, color]) => ({ code, name, letter, color }));

  // -> the explanation of one pixel, or undefined
  rayproof.explanationAt = (mask, width, x, y) => (mask ? rayproof.explanations.find(({ code }) => mask[y * width + x] === code) : undefined);

  // -> ImageData, see-through where no pixel needs an explanation
  rayproof.paintExplained = function (mask, width, height) {
    const picture = new ImageData(width, height);
    mask.forEach((value, pixel) => {
      const kind = rayproof.explanations.find(({ code }) => value === code);
      if (kind) picture.data.set([...kind.color, 215], 4 * pixel);
    });
    return picture;
  };

  rayproof.explainedCounts = (mask) => rayproof.explanations.map((kind) => ({ ...kind, count: mask.reduce((sum, value) => sum + (value === kind.code), 0) }))
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
  rayproof.histogramView = function (errors, range, log, limit, unit) {
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
    const words = beyond === null ? "" : `${beyond || "no"} pixel${beyond === 1 ? "" : "s"} beyond ${rayproof.short(limit)}, the limit of the deciding pixel; each pixel has a limit of its own`;
    const ticks = [0, 0.25, 0.5, 0.75, 1].map((at) => (log ? range[0] * (range[1] / range[0]) ** at : range[0] + at * (range[1] - range[0])));
    return e("figure", { class: "histogram" }, e("div", { class: "counts" },
      e("div", { class: "ends", "aria-hidden": "true" }, e("span", {}, Math.max(...bins)), e("span", {}, "pixels"), e("span", {}, 0)), e("div", {},
      svg("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img",
        "aria-label": `Histogram of ${errors.metric} errors; ${words || "no limit of this quantity"}` },
      bars, shown ? svg("line", { x1: at * WIDTH, x2: at * WIDTH, y1: 0, y2: HEIGHT, class: "limit" }) : null),
      e("div", { class: "axis", "aria-hidden": "true" }, ticks.map((value) => e("span", {}, rayproof.short(value, 2)))))),
      e("p", { class: "axis-name muted" }, `error (${rayproof.metricTitle(errors.metric)})${unit && unit !== rayproof.metricTitle(errors.metric) ? ` [${unit}]` : ""}`),
      e("figcaption", { class: "muted" }, [`${errors.values.length} pixels, counts on a log scale`, said, words].filter(Boolean).join(" \u00B7 ")));
  };
})(window.rayproof);
