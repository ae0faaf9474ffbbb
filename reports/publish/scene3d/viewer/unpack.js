// The inverse of `pack` in reports/publish/scene3d/view_file.py: base64, inflate, a JSON header, arrays as byte planes.
(function (viewer) {
  "use strict";

  async function inflate(text) {
    const bytes = Uint8Array.from(atob(text), (character) => character.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    return new Uint8Array(await new Response(stream).arrayBuffer());
  }

  function joined(planes) {
    const count = planes.length / 4;
    const words = new Uint32Array(count);
    for (let i = 0; i < count; i += 1) {
      words[i] = (planes[i] << 24) | (planes[count + i] << 16) | (planes[2 * count + i] << 8) | planes[3 * count + i];
    }
    return words.buffer;
  }

  // -> {about, scene, hashes: {name: {content: ArrayBuffer}}}, the last two as vtk.js's viewer takes them.
  viewer.unpack = async function (text) {
    const bytes = await inflate(text);
    const length = new DataView(bytes.buffer).getUint32(0, true);
    const { about, scene, arrays } = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    const hashes = {};
    let at = 4 + length;
    for (const [name, size, words] of arrays) {
      const part = bytes.slice(at, at + size);
      hashes[name] = { content: words ? joined(part) : part.buffer };
      at += size;
    }
    return { about, scene, hashes };
  };
})(window.viewer = window.viewer || {});
