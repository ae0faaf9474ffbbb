// One pixel's whole story: every stage of ours and of the reference, to the last bit, and what they differ by.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  // -> {node, show(x, y)}; columns are [title, renderer].
  rayproof.inspector = function (data, stages, columns, current, metric) {
    const body = e("tbody");
    const title = e("span", { class: "muted" }, "point at an image, or use the arrow keys on one");
    const command = e("div");
    const head = e("thead", {}, e("tr", {}, e("th", { scope: "col" }, "stage"),
      columns.map(([name]) => e("th", { scope: "col" }, name)), columns.length === 2 ? e("th", { scope: "col" }, metric) : null));
    let images = null;

    async function read() {
      const loading = stages.map((stage) => Promise.all(columns.map(([, renderer]) => data.image(renderer, stage.name))));
      return Promise.all(loading);
    }

    function rows(stage, pair, x, y) {
      const first = pair.find(Boolean);
      if (!first || x >= first.width || y >= first.height) return [];
      const names = data.channels[stage.name] || [];
      return Array.from({ length: first.channels }, (_, channel) => {
        const values = pair.map((image) => (image ? image.values[(y * image.width + x) * image.channels + channel] : null));
        const both = values.length === 2 && values.every((value) => value !== null);
        const gap = both ? rayproof.distance(metric, values[0], values[1]) : null;
        return e("tr", { class: stage.name === current ? "current" : "" },
          e("th", { scope: "row" }, channel ? "" : stage.name, e("span", { class: "muted" }, names[channel] === stage.name ? "" : ` ${names[channel] ?? channel}`)),
          values.map((value) => e("td", { class: "figure", "data-stage": stage.name, "data-channel": channel },
            value === null ? "" : rayproof.exact(value))),
          columns.length === 2 ? e("td", { class: `figure${gap ? " differs" : ""}` }, both ? rayproof.short(gap) : "") : null);
      });
    }

    const node = e("section", { class: "panel inspector", "aria-label": "Pixel" },
      e("h3", {}, "Pixel ", title), command,
      e("div", { class: "scroll" }, e("table", {}, head, body)));

    async function show(x, y) {
      images = images || await read();
      rayproof.replace(title, `column ${x}, row ${y}`);
      rayproof.replace(command, rayproof.command(`rayproof probe ${rayproof.quoted(data.name)} ${x} ${y}`));
      rayproof.replace(body, stages.map((stage, i) => rows(stage, images[i], x, y)));
    }
    return { node, show };
  };

  // A shell word: quoted where a shell would read anything into it.
  rayproof.quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);

  rayproof.command = function (text) {
    const button = e("button", { class: "quiet", onclick: () => copy(text, button) }, "copy");
    return e("div", { class: "command" }, e("code", {}, text), button);
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
})(window.rayproof);
