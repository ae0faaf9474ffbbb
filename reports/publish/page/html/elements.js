// Building the page. Text only ever becomes a text node, so no name or message can turn into markup.
(function (rayproof) {
  "use strict";
  // element("p", {class: "note", onclick: f}, "text", child, [children], null) -> HTMLElement
  rayproof.element = function (tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes || {})) {
      if (value === null || value === undefined || value === false) continue;
      if (name.startsWith("on")) node.addEventListener(name.slice(2), value);
      else if (name === "value") node.value = value;
      else node.setAttribute(name, value === true ? "" : String(value));
    }
    rayproof.append(node, children);
    return node;
  };

  rayproof.append = function (node, children) {
    for (const child of children.flat(Infinity)) {
      if (child === null || child === undefined || child === false) continue;
      node.append(child instanceof Node ? child : document.createTextNode(String(child)));
    }
    return node;
  };

  // Named by the browser itself, so that no address stands in the page.
  const SVG = new DOMParser().parseFromString("<svg></svg>", "text/html").body.firstChild.namespaceURI;

  // The same for parts of a drawing; attributes that are null are left out.
  rayproof.svg = function (tag, attributes, ...children) {
    const node = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) if (value !== null) node.setAttribute(name, String(value));
    return rayproof.append(node, children);
  };

  rayproof.replace = function (node, ...children) {
    node.replaceChildren();
    return rayproof.append(node, children);
  };

  // A table. On a narrow screen a row is a block in which each cell has its column's name, so that nothing is cut; between
  // the two what is wider than its panel scrolls, and the keyboard reaches it though nothing in it takes the focus.
  rayproof.scroll = (label, table) => rayproof.element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, rayproof.named(table));

  // A table of numbers that are compared along rows: it stays a table at any width; a phone leaves out what is less asked.
  rayproof.wide = (label, table) => {
    table.classList.add("wide");
    return rayproof.element("div", { class: "scroll", tabindex: "0", role: "group", "aria-label": label }, table);
  };

  // -> the table, each cell of which knows its column's name: once more where rows came later
  rayproof.named = function (table) {
    const columns = [...table.querySelectorAll("thead tr:last-child > *")].map((cell) => cell.dataset.name ?? cell.textContent);
    for (const row of table.querySelectorAll("tbody > tr")) {
      [...row.children].forEach((cell, i) => { if (columns[i] && cell.tagName === "TD" && row.children.length === columns.length) cell.dataset.column = columns[i].replaceAll("/", "/\u200B"); });
    }
    table.classList.add("stacked");
    return table;
  };

  // A line may end between the parts of a name: float32/sphere=textbook.
  const soft = (text) => text.split("/").flatMap((part, i) => (i ? ["/", document.createElement("wbr"), part] : [part]));

  // Words of a command: a line breaks between them, and within one only where it is longer than a line.
  rayproof.code = (text) => rayproof.element("code", {}, String(text).split(" ").flatMap((word, i) => [i ? " " : "", rayproof.element("span", {}, soft(word))]));

  // A configuration or a renderer.
  rayproof.parts = (name) => soft(String(name ?? ""));

  // A reference as people read it; the page of the run names those whose name is also a word of the field.
  rayproof.displayNames = {};
  rayproof.reference = (name) => (Object.hasOwn(rayproof.displayNames, name) ? rayproof.displayNames[name] : String(name ?? ""));

  // A word of rayproof's with a link to its definition; plain where the page has no definitions.
  rayproof.terms = new Set();
  rayproof.term = (word, text = word) => (rayproof.terms.has(word) ? rayproof.element("a", { class: "term", href: rayproof.link({ page: "terms", term: word }), title: `what \u201C${word}\u201D means` }, text) : text);

  // Prose of a record: what stands between backticks is code.
  rayproof.prose = function (text) {
    const parts = String(text ?? "").split("`");
    return parts.map((part, i) => (i % 2 === 0 ? soft(part) : i === parts.length - 1 ? soft(`\`${part}`) : rayproof.code(part)));
  };

  // Whether the window is a phone's.
  rayproof.narrow = () => window.matchMedia("screen and (max-width: 760px)").matches;

  // A <select> of [value, label] pairs; a third entry says why there is no such choice now.
  rayproof.select = function (label, pairs, current, onchange) {
    const e = rayproof.element;
    const options = pairs.map(([value, text, why]) => e("option", { value, disabled: Boolean(why) }, why ? `${text}: ${why}` : text));
    const node = e("select", { "aria-label": label, onchange: () => onchange(node.value) }, options);
    node.value = current;
    return e("label", { class: "control" }, e("span", {}, label), node);
  };

  // Numbers as text. results.json writes what JSON cannot carry as "inf", "-inf" and "nan".
  rayproof.number = function (value) {
    if (typeof value === "number") return value;
    return { inf: Infinity, "-inf": -Infinity, nan: NaN }[value] ?? null;
  };

  function special(value) {
    if (Number.isNaN(value)) return "NaN";
    if (value === Infinity) return "inf";
    if (value === -Infinity) return "-inf";
    return Object.is(value, -0) ? "-0" : null;
  }

  // Few digits, for tables.
  rayproof.short = function (value, digits = 3) {
    value = rayproof.number(value);
    if (value === null) return "";
    const text = special(value);
    if (text !== null) return text;
    if (value === 0) return "0";
    const size = Math.abs(value);
    return size >= 1e5 || size < 1e-3 ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
  };

  // As few digits as give back exactly this float32 (nine always do).
  rayproof.exact = function (value) {
    const text = special(value);
    if (text !== null) return text;
    for (let digits = 1; digits < 9; digits += 1) {
      const candidate = Number(value.toPrecision(digits));
      if (Math.fround(candidate) === value) return String(candidate);
    }
    return String(Number(value.toPrecision(9)));
  };

  rayproof.seconds = function (value) {
    value = rayproof.number(value);
    if (value === null) return "";
    if (value > 0 && value < 0.005) return `${rayproof.short(1000 * value, 2)} ms`;
    return value < 10 ? `${value.toFixed(2)} s` : value < 120 ? `${value.toFixed(0)} s` : `${(value / 60).toFixed(1)} min`;
  };

  // The heading of a column of such bars, with their axis.
  rayproof.ratioHead = (title) => [title, rayproof.element("span", { class: "ratio-axis", "aria-hidden": "true" }, ["0.001", "1", "10"].map((text) => rayproof.element("i", {}, text)))];

  // An error over its limit in words: far over it the number says something about the limit only.
  const MOST = 1000;
  rayproof.ratio = function (value, digits = 3) {
    value = rayproof.number(value);
    return value !== null && value >= MOST ? `over ${MOST}` : rayproof.short(value, digits);
  };

  // Error over limit as a bar on a log scale from 1/1000 to 10, the limit marked; and the number. Red is what is blamed.
  rayproof.ratioBar = function (value, { blamed = true } = {}) {
    const e = rayproof.element;
    value = rayproof.number(value);
    if (value === null) return e("span", { class: "muted" }, "\u2013");
    const share = Number.isNaN(value) ? 1 : Math.min(1, Math.max(0, (Math.log10(Math.max(value, 1e-3)) + 3) / 4));
    const over = !(value <= 1);
    const fill = e("i", { class: over ? (blamed ? "over" : "elsewhere") : value > 0.8 ? "close" : "" });
    fill.style.width = `${100 * share}%`;
    const title = "error over its limit; log scale from 0.001 to 10, the mark is the limit";
    return e("span", { class: "ratio", title }, e("span", { class: "bar" }, fill), rayproof.ratio(value));
  };

  // The eight verdicts: a shape and a word beside every colour, best first as in reports/results/outcomes.py.
  const VERDICTS = {
    pass: ["\u2713", "pass"],
    warn: ["\u25B2", "warn"],
    undecided: ["\u25D0", "undecided"],
    unsupported: ["\u25CB", "unsupported"],
    missing: ["?", "missing"],
    reference_suspect: ["\u25C6", "reference suspect"],
    error: ["\u25A0", "error"],
    fail: ["\u2715", "fail"],
  };
  const ORDER = Object.keys(VERDICTS);
  rayproof.verdicts = ORDER;

  rayproof.glyph = (verdict) => (VERDICTS[verdict] || ["?"])[0];
  rayproof.word = (verdict) => (VERDICTS[verdict] || [null, String(verdict)])[1];
  rayproof.tone = (verdict) => `v-${ORDER.includes(verdict) ? verdict : "missing"}`;
  // What is undecided says nothing: the others decide, if there are any.
  rayproof.worst = function (verdicts) {
    const decided = verdicts.filter((verdict) => verdict !== "undecided");
    return ORDER[Math.max(-1, ...(decided.length ? decided : verdicts).map((verdict) => ORDER.indexOf(verdict)))] || null;
  };

  // Each verdict with its sign.
  rayproof.verdictLegend = () => ORDER.map((name) => [rayproof.element("span", { class: `glyph mark ${rayproof.tone(name)}`, "aria-hidden": "true" }, rayproof.glyph(name)), " ", rayproof.word(name), "  "]);

  rayproof.pill = function (verdict) {
    const e = rayproof.element;
    return e("span", { class: `pill ${rayproof.tone(verdict)}` },
      e("span", { "aria-hidden": "true", class: "glyph" }, rayproof.glyph(verdict)), rayproof.word(verdict));
  };

  // One renderer's word on one case: [worst verdict, checks that have it, all checks, worst ratio, stages unsupported].
  rayproof.cell = function (cell, renderer) {
    const e = rayproof.element;
    if (!cell) return e("span", { class: "cell none", title: `${renderer}: not asked` }, "\u00B7");
    const [verdict, count, total, ratio, unsupported] = cell;
    const partial = unsupported && verdict !== "unsupported" ? "*" : "";
    const title = `${rayproof.reference(renderer)}: ${count} of ${total} checks ${rayproof.word(verdict)}`
      + (ratio === null ? "" : `, worst error / limit ${rayproof.ratio(ratio)}`) + (unsupported ? `, ${unsupported} stages unsupported` : "");
    return e("span", { class: `cell ${rayproof.tone(verdict)}`, title },
      e("span", { class: "glyph", "aria-hidden": "true" }, rayproof.glyph(verdict)), e("span", { class: "offscreen" }, rayproof.word(verdict)), ` ${verdict === "unsupported" ? unsupported : count}${partial}`);
  };

  // A command line to copy.
  const e = rayproof.element;

  rayproof.command = function (text) {
    const button = e("button", { class: "quiet", onclick: () => copy(text, button) }, "copy");
    return e("div", { class: "command" }, rayproof.code(text), button);
  };

  async function copy(text, button) {
    try {
      await navigator.clipboard.writeText(text);
    } catch {
      // Not allowed, or no clipboard on this page: the old way.
      const area = e("textarea", { class: "offscreen", value: text });
      document.body.append(area);
      area.select();
      document.execCommand("copy");
      area.remove();
    }
    rayproof.replace(button, "copied");
    setTimeout(() => rayproof.replace(button, "copy"), 1500);
  }
})(window.rayproof = window.rayproof || {});
