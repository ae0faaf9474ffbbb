// Float images as reports/results/float_codec.py stores them, decoded bit for bit.
(function (rayproof) {
  "use strict";

  // What an image's floats are foretold to be: reports/results/float_codec.py in JavaScript, rounding for rounding.

  const finite = (value) => (Number.isFinite(value) ? value : 0);

  // A stage that is an earlier one times a constant per object.
  function times(source, objects, table) {
    const { values, channels } = source;
    const result = new Float32Array(values.length);
    const none = new Array(channels).fill(0);
    for (let pixel = 0; pixel * channels < values.length; pixel += 1) {
      const index = objects.values[pixel * objects.channels];
      const key = Number.isInteger(index) ? String(index) : "other";
      const scale = Object.hasOwn(table, key) ? table[key] : none;
      for (let c = 0; c < channels; c += 1) {
        result[pixel * channels + c] = finite(Math.fround(values[pixel * channels + c] * scale[c]));
      }
    }
    return result;
  }

  function along(ray, distance, eye) {
    const result = new Float32Array(ray.values.length);
    for (let i = 0; i < result.length; i += 1) {
      result[i] = finite(Math.fround(eye[i % 3] + distance.values[Math.floor(i / 3)] * ray.values[i]));
    }
    return result;
  }

  function through([corner, across, down], width, height) {
    const result = new Float32Array(3 * width * height);
    for (let row = 0, at = 0; row < height; row += 1) {
      for (let column = 0; column < width; column += 1, at += 3) {
        const [x, y] = [column + 0.5, row + 0.5];
        const d = [0, 1, 2].map((i) => (corner[i] + x * across[i]) + y * down[i]);
        const length = Math.sqrt((d[0] * d[0] + d[1] * d[1]) + d[2] * d[2]);
        for (let i = 0; i < 3; i += 1) result[at + i] = finite(Math.fround(d[i] / length));
      }
    }
    return result;
  }

  // Each light is [x, y, z, and its intensity by channel].
  function lit(position, normal, visibility, lights) {
    const result = new Float32Array(position.values.length), n = normal.values, seen = visibility.values;
    for (let pixel = 0, at = 0; at < result.length; pixel += 1, at += 3) {
      const total = [0, 0, 0];
      lights.forEach((light, number) => {
        const d = [0, 1, 2].map((i) => light[i] - position.values[at + i]);
        const squared = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
        const cosine = ((n[at] * d[0] + n[at + 1] * d[1]) + n[at + 2] * d[2]) / Math.sqrt(squared);
        const share = seen[pixel * visibility.channels + number] > 0 && cosine > 0 ? cosine / squared : 0;
        for (let c = 0; c < 3; c += 1) total[c] += light[3 + c] * share;
      });
      for (let c = 0; c < 3; c += 1) result[at + c] = finite(Math.fround(total[c]));
    }
    return result;
  }

  // -> Float32Array, or null where 0 is foretold; `get(renderer, stage)` promises a decoded image.
  rayproof.predict = async function (stored, stage, renderer, base, get) {
    if (stored.by === "base") return (await get(base, stage)).values;
    if (stored.by === "factors") {
      return times(await get(renderer, stored.of), await get(renderer, "object"), stored.factors);
    }
    if (stored.by === "pinhole") return through(stored.rays, stored.width, stored.height);
    if (stored.by === "ray") return along(await get(renderer, "ray"), await get(renderer, "distance"), stored.eye);
    if (stored.by === "lights") {
      const [position, normal, visibility] = await Promise.all(["position", "normal", "visibility"].map((one) => get(renderer, one)));
      return lit(position, normal, visibility, stored.lights);
    }
    return null;
  };

  // The inverse of reports/results/float_codec.py: base64, inflate, byte planes, zigzag, and the difference to a prediction.

  rayproof.inflate = async function (text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  rayproof.inflateText = async (text) => new TextDecoder().decode(await rayproof.inflate(text));

  // -> Float32Array, interleaved; `prediction` is a Float32Array, or null where 0 was foretold.
  rayproof.floats = async function (stored, prediction) {
    const { width, height, channels } = stored;
    const planes = await rayproof.inflate(stored.data);
    const count = width * height * channels;
    const bits = new Int32Array(count);
    const under = prediction && new Int32Array(prediction.buffer);
    for (let c = 0, from = 0; c < channels; c += 1) {
      for (let y = 0; y < height; y += 1) {
        let slope = 0, value = 0;
        for (let x = 0, to = y * width * channels + c; x < width; x += 1, from += 1, to += channels) {
          const code = (planes[from] << 24) | (planes[count + from] << 16) | (planes[2 * count + from] << 8) | planes[3 * count + from];
          const step = (code >>> 1) ^ -(code & 1);
          if (stored.curved) {
            slope = (slope + step) | 0;
            value = (value + slope) | 0;
          } else value = step;
          bits[to] = under ? value + under[to] : value;
        }
      }
    }
    return new Float32Array(bits.buffer);
  };
})(window.rayproof);
