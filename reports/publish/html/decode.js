// The inverse of reports/publish/encoding.py: base64, inflate, byte planes, and the difference to a base image.
(function (rayproof) {
  "use strict";

  rayproof.inflate = async function (text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  };

  rayproof.inflateText = async (text) => new TextDecoder().decode(await rayproof.inflate(text));

  // -> Float32Array, interleaved; `base` is the decoded image that this one was stored against.
  rayproof.floats = async function (image, base) {
    const planes = await rayproof.inflate(image.data);
    const count = planes.length / 4;
    const bits = new Int32Array(count);
    for (let i = 0; i < count; i += 1) {
      bits[i] = (planes[i] << 24) | (planes[count + i] << 16) | (planes[2 * count + i] << 8) | planes[3 * count + i];
    }
    if (image.against) {
      const under = new Int32Array(base.buffer);
      for (let i = 0; i < count; i += 1) bits[i] = ((bits[i] >>> 1) ^ -(bits[i] & 1)) + under[i];
    }
    return new Float32Array(bits.buffer);
  };
})(window.rayproof);
