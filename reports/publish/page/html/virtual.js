// A table body of any length: only the rows near the window exist. All rows have one height, which the style sets.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const BEYOND = 20; // rows drawn beyond either end of the window

  // make(item, index) -> <tr>. -> {body, show(items), laid(), reveal(index)}
  rayproof.virtualBody = function (make, columns) {
    const body = e("tbody");
    const spacer = () => e("tr", { class: "spacer", "aria-hidden": "true" }, e("td", { colspan: columns }));
    const above = spacer(), below = spacer();
    let items = [], made = new Map(), range = "", height = 0, frame = 0;

    function measure() {
      const row = body.querySelector("tr:not(.spacer)");
      height = row ? row.getBoundingClientRect().height || height : height;
    }

    function draw() {
      const size = height || 40;
      const top = body.isConnected ? body.getBoundingClientRect().top : 0;
      const first = Math.max(0, Math.min(items.length - 1, Math.floor(-top / size)) - BEYOND);
      const last = Math.min(items.length, Math.max(0, Math.ceil((window.innerHeight - top) / size)) + BEYOND);
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
})(window.rayproof);
