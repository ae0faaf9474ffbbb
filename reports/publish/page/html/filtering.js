// Which cases are listed and in what order; all of it from the address.
(function (rayproof) {
  "use strict";

  rayproof.filters = ["verdict", "family", "id", "stage", "q"];

  rayproof.matches = function (row, filter) {
    if (filter.verdict && row.verdict !== filter.verdict) return false;
    if (filter.family && row.family !== filter.family) return false;
    if (filter.id && !(row.covers || []).includes(filter.id)) return false;
    if (filter.stage && !row.stages.includes(filter.stage) && row.stage !== filter.stage) return false;
    const words = (filter.q || "").toLowerCase().split(/\s+/).filter(Boolean);
    if (!words.length) return true;
    // Of a long run reasons and what cases are for are known once their rows were in view.
    const text = [row.name, row.reason, row.stresses, row.blame, ...(row.covers || [])].join(" ").toLowerCase();
    return words.every((word) => text.includes(word));
  };

  const size = (value) => {
    const number = rayproof.number(value);
    return number === null ? -1 : Number.isNaN(number) ? Infinity : number;
  };
  const KEYS = {
    verdict: (row) => rayproof.verdicts.indexOf(row.verdict),
    name: (row) => row.name,
    blame: (row) => row.blame || "\uffff",
    ratio: (row) => size(row.ratio),
    time: (row) => size(row.seconds),
  };
  // What is sorted from the largest at the first click: the worst is looked for first.
  rayproof.descends = (key) => key !== "name" && key !== "blame";

  // `order` is "" (worst first, as the rows come), a key, or "-key"; a key beyond these is a column of the matrix.
  rayproof.sorted = function (rows, order) {
    if (!order) return rows;
    const back = order.startsWith("-");
    const name = back ? order.slice(1) : order;
    const column = name.startsWith("by ") ? name.slice(3) : null;
    const key = column !== null ? (row) => rank(row.cells?.[column]) : Object.hasOwn(KEYS, name) ? KEYS[name] : null;
    if (!key) return rows;
    const compare = (a, b) => (a < b ? -1 : a > b ? 1 : 0);
    return [...rows].sort((a, b) => (back ? -1 : 1) * compare(key(a), key(b)));
  };

  // A cell's verdict, then its error over limit.
  const rank = (cell) => (cell ? rayproof.verdicts.indexOf(cell[0]) * 1e6 + Math.min(1e5, size(cell[3])) : -1);
})(window.rayproof);
