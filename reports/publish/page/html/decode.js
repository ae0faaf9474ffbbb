// The inverse of reports/results/float_codec.py: base64, inflate, byte planes, zigzag, and the difference to a prediction.
(function (rayproof) {
  "use strict";

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
