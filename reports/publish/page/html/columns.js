// The cases of a long run: columns in the page, and the rest of a row in a script of a shard, loaded when it is wanted.
(function (rayproof) {
  "use strict";

  const parsed = async (text) => JSON.parse(await rayproof.inflateText(text));
  const all = async (packed) => Object.fromEntries(await Promise.all(Object.entries(packed).map(async ([key, text]) => [key, await parsed(text)])));
  const file = (place) => (number) => `data/${String(Math.floor(number / place)).padStart(3, "0")}`;

  // -> Promise of the rows, worst first, each with what the list is filtered and sorted by
  rayproof.rows = async function (results) {
    if (results.cases) return results.cases;
    const { count, shard, values: tables, columns: texts, thumbnails } = results.list;
    const [values, columns] = await Promise.all([all(tables), all(texts)]);
    const folder = file(shard);
    const rows = [];
    for (let i = 0; i < count; i += 1) {
      const row = { name: columns.name[i], ratio: columns.ratio[i], seconds: columns.seconds[i], file: `${folder(i)}/${String(i + 1).padStart(4, "0")}.js`, place: i };
      for (const key in values) row[key] = values[key][columns[key][i]];
      if (thumbnails[i]) row.thumbnail = thumbnails[i];
      rows.push(row);
    }
    const loading = new Map();
    // -> Promise, done when the rest of a row is there, and of all in its shard
    rayproof.complete = function (row) {
      if (row.cells) return null;
      const at = Math.floor(row.place / shard) * shard;
      if (!loading.has(at)) {
        loading.set(at, rayproof.request(`${folder(at)}/rows.js`).then(parsed).then((rest) => rest.forEach((one, i) => Object.assign(rows[at + i], one))));
        loading.get(at).catch(() => loading.delete(at));
      }
      return loading.get(at);
    };
    return rows;
  };

  rayproof.complete = () => null;
})(window.rayproof);
