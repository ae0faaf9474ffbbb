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

  // The cases of a long run: columns in the page, and the rest of a row in a script of a shard, loaded when it is wanted.
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

  // A table body of any length: only the rows near the window exist. All rows have one height, which the style sets.
  const e = rayproof.element;
  const BEYOND = 20; // rows drawn beyond either end of the window
  const PRINTED = 1000; // rows on paper

  // make(item, index) -> <tr>. -> {body, show(items), laid(), reveal(index)}
  rayproof.virtualBody = function (make, columns) {
    const body = e("tbody");
    const spacer = () => e("tr", { class: "spacer", "aria-hidden": "true" }, e("td", { colspan: columns }));
    const above = spacer(), below = spacer();
    let items = [], made = new Map(), range = "", height = 0, frame = 0, printing = false;

    function measure() {
      const row = body.querySelector("tr:not(.spacer)");
      height = row ? row.getBoundingClientRect().height || height : height;
    }

    function draw() {
      const size = height || 40;
      const top = body.isConnected ? body.getBoundingClientRect().top : 0;
      const first = printing ? 0 : Math.max(0, Math.min(items.length - 1, Math.floor(-top / size)) - BEYOND);
      const last = printing ? Math.min(items.length, PRINTED) : Math.min(items.length, Math.max(0, Math.ceil((window.innerHeight - top) / size)) + BEYOND);
      const key = `${first} ${last} ${size}`;
      if (key === range) return;
      range = key;
      const kept = new Map();
      for (let i = first; i < Math.max(last, first); i += 1) {
        const row = made.get(i) || make(items[i], i);
        row.setAttribute("aria-rowindex", i + 2);
        kept.set(i, row);
      }
      above.firstChild.style.height = `${first * size}px`;
      below.firstChild.style.height = `${Math.max(0, items.length - Math.max(last, first)) * size}px`;
      above.hidden = first === 0;
      below.hidden = last >= items.length;
      const wanted = [above, ...kept.values(), below];
      // Rows that stay are not touched: the one in focus keeps it.
      for (const [i, row] of made) if (!kept.has(i)) row.remove();
      wanted.forEach((row, i) => { if (body.children[i] !== row) body.insertBefore(row, body.children[i] || null); });
      made = kept;
    }

    const scrolled = () => {
      if (!body.isConnected) return;
      cancelAnimationFrame(frame);
      frame = requestAnimationFrame(draw);
    };
    window.addEventListener("scroll", scrolled, { passive: true });
    // On paper there is no window: all rows are there, as many as a person turns over.
    window.addEventListener("beforeprint", () => { if (body.isConnected) { printing = true; draw(); } });
    window.addEventListener("afterprint", () => { printing = false; if (body.isConnected) draw(); });
    window.addEventListener("resize", () => { if (body.isConnected) { measure(); range = ""; draw(); } });

    const laid = () => { measure(); range = ""; draw(); };
    return {
      body, laid,
      show: (list) => {
        items = list;
        made = new Map();
        range = "";
        body.replaceChildren();
        draw();
        if (body.isConnected) laid();
      },
      reveal: (index) => {
        if (!made.has(index)) window.scrollBy(0, body.getBoundingClientRect().top + index * height - window.innerHeight / 2);
        draw();
        return made.get(index);
      },
    };
  };

  // A contact sheet: ours of every case at one stage, worst first. What is in sight is read and painted, one after the other.
  rayproof.contactSheet = function (results, { open }) {
    const stages = results.stages.map((item) => item.name).filter((name) => name !== "camera");
    const rows = results.alone ? results.cases.filter((row) => rayproof.inlined(row.file)) : results.cases;
    const left = results.cases.length - rows.length;
    let stage = stages.includes(rayproof.address().sheet) ? rayproof.address().sheet : stages.at(-1);
    let waiting = [], busy = false;
    const tiles = new Map();

    function tile(row) {
      const picture = e("canvas", { width: 96, height: 72, role: "img", "aria-label": `ours of ${row.name}` });
      const node = e("a", { href: rayproof.link({ case: row.name, stage }), class: rayproof.tone(row.verdict), title: `${row.name}: ${rayproof.word(row.verdict)}, ${row.wrong || `error / limit ${rayproof.ratio(row.ratio) || "not measured"}`}` },
        picture, e("span", {}, e("i", { class: "glyph mark", "aria-hidden": "true" }, rayproof.glyph(row.verdict)), " ", e("bdi", {}, row.name)));
      tiles.set(node, { row, picture, painted: null });
      return node;
    }

    async function paint({ row, picture }, wanted) {
      const data = await rayproof.glance(row), { ours } = rayproof.sides(results, data);
      const mine = ours.includes("tracer-float32") ? "tracer-float32" : ours[0];
      const image = mine === undefined ? null : await data.image(mine, wanted);
      const context = picture.getContext("2d");
      context.clearRect(0, 0, picture.width, picture.height);
      picture.classList.toggle("absent", !image);
      if (!image) return;
      Object.assign(picture, { width: image.width, height: image.height });
      context.putImageData(rayproof.paint(wanted, image, rayproof.scaleOf(wanted, image), { channel: -1, exposure: 0, gamma: 0, map: "" }), 0, 0);
    }

    async function next() {
      if (busy) return;
      busy = true;
      for (let node = waiting.shift(); node && grid.isConnected; node = waiting.shift()) {
        const one = tiles.get(node);
        if (one.painted === stage) continue;
        one.painted = stage;
        await paint(one, stage).catch(() => one.picture.classList.add("absent"));
      }
      busy = false;
      grid.dataset.painted = stage; // all in sight are
    }

    const sight = new Set();
    const look = (nodes) => { waiting = [...waiting, ...nodes]; delete grid.dataset.painted; next(); };
    const seen = new IntersectionObserver((entries) => {
      for (const { target, isIntersecting } of entries) if (isIntersecting) sight.add(target); else sight.delete(target);
      waiting = waiting.filter((node) => sight.has(node));
      look(entries.filter((one) => one.isIntersecting).map((one) => one.target));
    }, { rootMargin: "80px" });

    const grid = e("div", { class: "sheet" });
    function turn(by) {
      stage = stages[(stages.indexOf(stage) + by + stages.length) % stages.length];
      rayproof.amend({ sheet: stage });
      chooser.querySelector("select").value = stage;
      for (const node of tiles.keys()) node.href = rayproof.link({ case: tiles.get(node).row.name, stage });
      look([...tiles.keys()].filter((node) => sight.has(node)));
    }
    const chooser = rayproof.select("stage of the sheet", stages.map((name) => [name, name]), stage, (name) => turn(stages.indexOf(name) - stages.indexOf(stage)));
    const fill = () => { if (!tiles.size) rayproof.append(grid, rows.map((row) => { const node = tile(row); seen.observe(node); return node; })); };
    const head = [e("h2", {}, "All cases, ours, worst first"), chooser, e("span", { class: "muted" }, e("kbd", {}, "["), e("kbd", {}, "]"), left ? `; ${left} other cases are in the folder's report only` : "")];
    const node = open ? e("section", { class: "panel sheets", "aria-label": "Contact sheet" }, e("div", { class: "sheet-head" }, head), grid)
      : e("details", { class: "panel sheets", ontoggle: fill }, e("summary", {}, "Contact sheet of all cases"), e("div", { class: "sheet-head" }, head.slice(1)), grid);
    if (open) fill();
    return { node, turn };
  };

  // The matrix of cases and renderers, worst first; filters and order live in the address.
  rayproof.caseList = function (results) {
    const count = e("span", { class: "muted", role: "status" });
    const controls = e("div", { class: "controls" });
    const head = e("tr");
    const holder = e("div", { class: "scroll" });
    let rows = [], columns = [], virtual = null, table = null;

    const says = (row) => (row.verdict === "pass" ? row.stresses : [row.wrong, row.reason || row.stresses].filter(Boolean).join(". ")) || "\u00A0";
    const cells = (row) => [
      e("td", { class: "state" }, rayproof.pill(row.verdict)),
      e("th", { scope: "row", class: "name" }, e("a", { href: rayproof.link({ case: row.name, stage: row.stage }) }, e("bdi", {}, row.name)),
        e("div", { class: "muted", title: says(row) }, rayproof.prose(says(row)))),
      e("td", { class: "blame", title: row.items || null }, row.blame),
      e("td", { class: "size" }, rayproof.ratioBar(row.ratio)),
      columns.map((name) => e("td", { class: "matrix", "data-label": name }, row.cells ? rayproof.cell(row.cells[name], name) : null)),
      e("td", { class: "figure time" }, rayproof.seconds(row.seconds))];

    function line(row) {
      const node = e("tr", { class: rayproof.tone(row.verdict) }, cells(row));
      rayproof.complete(row)?.then(() => {
        const held = node.contains(document.activeElement);
        rayproof.replace(node, cells(row));
        if (held) node.querySelector("a").focus();
      }, () => {}); // what the page has of it stays
      return node;
    }

    function heading(order) {
      const title = (key, text, more = {}, below = null) => {
        const now = order.replace(/^-/, "") === key ? (order.startsWith("-") ? "descending" : "ascending") : null;
        const first = rayproof.descends(key) ? `-${key}` : key, second = rayproof.descends(key) ? key : `-${key}`;
        return e("th", { scope: "col", "aria-sort": now, ...more }, e("button", { class: "sorter", title: `sort by ${text}`,
          onclick: () => set({ sort: order === first ? second : order === second ? "" : first }) }, text,
        e("span", { "aria-hidden": "true" }, now === "descending" ? " \u25BE" : now ? " \u25B4" : "")), below);
      };
      return [title("verdict", "verdict"), title("name", "case", { class: "name" }), title("blame", "blamed"), title("ratio", "error / limit", {}, rayproof.ratioHead("")),
        columns.map((name) => (results.list ? e("th", { scope: "col", class: "matrix" }, rayproof.reference(name)) : title(`by ${name}`, rayproof.reference(name), { class: "matrix" }))), title("time", "time", { class: "figure" })];
    }

    function show() {
      const filter = rayproof.address();
      rows = rayproof.sorted(results.cases.filter((row) => rayproof.matches(row, filter)), filter.sort || "");
      const total = rows.length === results.cases.length ? `${rows.length}` : `${rows.length} of ${results.cases.length}`;
      rayproof.replace(count, filter.sort ? total : `${total}, worst first`);
      rayproof.replace(head, heading(filter.sort || ""));
      table.setAttribute("aria-rowcount", rows.length + 1);
      virtual.show(rows);
      if (!rows.length) rayproof.append(virtual.body, [e("tr", {}, e("td", { colspan: 5 + columns.length, class: "muted" }, "No case matches."))]);
    }

    function set(parts) {
      rayproof.amend(parts);
      build();
      show();
    }

    function build() {
      const filter = rayproof.address();
      const held = controls.contains(document.activeElement) ? document.activeElement.getAttribute("aria-label") : null;
      columns = filter.columns === "ours" ? results.columns.ours : results.columns.references;
      virtual = rayproof.virtualBody(line, 5 + columns.length);
      table = e("table", { class: "cases" }, e("thead", {}, head), virtual.body);
      rayproof.replace(holder, table);
      const distinct = (key) => [...new Set(results.cases.map((row) => row[key]))].sort();
      const present = rayproof.verdicts.filter((name) => results.cases.some((row) => row.verdict === name)).reverse();
      const pick = (key, title, values) => rayproof.select(title, [["", `any ${title}`], ...values.map((value) => [value, rayproof.word(value)])],
        filter[key] || "", (value) => set({ [key]: value }));
      const search = e("input", { type: "search", placeholder: results.list ? "name, id, blamed \u2026" : "name, reason, id \u2026", "aria-label": "search",
        value: filter.q || "", oninput: () => { rayproof.amend({ q: search.value }); show(); } });
      rayproof.replace(controls, pick("verdict", "verdict", present), pick("family", "family", distinct("family")),
        pick("id", "id", results.coverage.map((item) => item.id)), pick("stage", "stage", results.stages.map((stage) => stage.name)),
        e("label", { class: "control grow" }, e("span", {}, "search"), search),
        results.columns.ours.length > 1 ? rayproof.select("columns", [["", "references"], ["ours", "under test"]], filter.columns || "", (value) => set({ columns: value, sort: "" })) : null,
        rayproof.filters.some((key) => filter[key]) ? e("button", { class: "quiet", onclick: clear }, "clear") : null);
      if (held) controls.querySelector(`[aria-label="${CSS.escape(held)}"]`)?.focus();
    }

    const clear = () => set(Object.fromEntries(rayproof.filters.map((key) => [key, ""])));

    // The next case of the list gets the focus, from wherever it is.
    function step(by) {
      const current = document.activeElement?.closest?.(".cases tbody tr");
      const at = current ? Number(current.getAttribute("aria-rowindex")) - 2 + by : 0;
      if (at >= 0 && at < rows.length) virtual.reveal(at)?.querySelector("a").focus();
    }

    build();
    show();
    const section = e("section", { class: "panel", id: "cases", "aria-label": "Cases" },
      e("h2", {}, "Cases ", count), controls, holder,
      e("p", { class: "muted legend" }, "Per renderer: its worst ", rayproof.term("verdict"), " and how many ", rayproof.term("check", "checks"), " have it; * some stages unsupported; ", rayproof.term("error / limit"), ": above 1 a pixel is wrong. ",
        rayproof.verdictLegend()));
    return { section, set: (parts) => { set(parts); section.scrollIntoView(); }, search: () => controls.querySelector("input")?.focus(),
      clear, step, rows: () => rows, laid: () => virtual.laid() };
  };
})(window.rayproof);
