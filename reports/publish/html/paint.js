// A stage's floats as colours. Radiometric stages: exposure, then sRGB. Directions: [-1, 1] to [0, 1]. Distances and
// positions: their range. Indices: a colour each. NaN is magenta, an infinity cyan, the distance of a miss grey.
(function (rayproof) {
  "use strict";

  const SIGNED = new Set(["ray", "normal"]);
  const LIGHT = new Set(["irradiance", "exitance", "radiance"]);
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
      if (value > 0) finite.push(value);
    }
    finite.sort((a, b) => a - b);
    // White is what all but the brightest hundredth stay below.
    return { ranges, white: finite.length ? finite[Math.floor(0.99 * (finite.length - 1))] : 1 };
  };

  // -> ImageData
  rayproof.paint = function (stage, image, scale, { channel = -1, exposure = 0 } = {}) {
    const { width, height, channels, values } = image;
    const picture = new ImageData(width, height);
    const gain = 2 ** exposure / scale.white;
    const tone = toneOf(stage, scale, gain);
    for (let pixel = 0; pixel < width * height; pixel += 1) {
      const color = colorOf(stage, values, pixel * channels, channels, channel, tone, scale);
      picture.data.set([color[0], color[1], color[2], 255], 4 * pixel);
    }
    return picture;
  };

  function toneOf(stage, scale, gain) {
    if (SIGNED.has(stage)) return (value) => 127.5 * (1 + value);
    if (LIGHT.has(stage)) return (value) => rayproof.srgb(value * gain);
    if (stage === "visibility") return (value) => 30 + 210 * value;
    return (value, c) => {
      const [low, high] = scale.ranges[c] || [0, 1];
      return 255 * (high > low ? (value - low) / (high - low) : 0.5);
    };
  }

  function colorOf(stage, values, start, channels, channel, tone, scale) {
    const from = channel < 0 ? 0 : channel;
    const to = channel < 0 ? channels : channel + 1;
    for (let c = from; c < to; c += 1) if (Number.isNaN(values[start + c])) return rayproof.NAN;
    for (let c = from; c < to; c += 1) {
      if (!Number.isFinite(values[start + c])) {
        return stage === "distance" && values[start + c] > 0 ? rayproof.MISS : rayproof.INFINITE;
      }
    }
    if (stage === "object") {
      const index = values[start + (channel < 0 ? 0 : channel)];
      return index < 0 ? rayproof.MISS : rayproof.indexColor(index);
    }
    if (stage === "distance") {
      const at = rayproof.viridis.at(1 - tone(values[start], 0) / 255);
      return rayproof.viridis.table.subarray(at, at + 3);
    }
    if (channel >= 0) {
      const grey = tone(values[start + channel], channel);
      return [grey, grey, grey];
    }
    if (channels === 3) return [0, 1, 2].map((c) => tone(values[start + c], c));
    let sum = 0;
    for (let c = 0; c < channels; c += 1) sum += tone(values[start + c], c) / channels;
    return [sum, sum, sum];
  }
})(window.rayproof);
