// One pixel's whole story: every stage of every renderer, to the last bit, and the command that tells it again.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  // -> {node, show(x, y)}; `renderers` in order, the first of them ours, the second the reference compared with.
  rayproof.inspector = function (data, stages) {
    const body = e("tbody"), head = e("thead");
    const title = e("span", { class: "muted", role: "status" }, "point at an image, or use the arrow keys on one");
    const kinds = e("p", { class: "muted kinds" });
    const command = e("div");
    const node = e("section", { class: "panel inspector", "aria-label": "Pixel" }, e("h3", {}, "Pixel ", title), command, kinds,
      rayproof.scroll("every stage of every renderer", e("table", {}, head, body)));
    let images = null, wanted = null, context = { renderers: data.renderers, ours: "", theirs: "", stage: "", metric: "absolute" };

    const read = () => Promise.all(stages.map((stage) => Promise.all(data.renderers.map((renderer) => data.image(renderer, stage.name)))));

    function rows(stage, found, x, y) {
      const byName = new Map(data.renderers.map((name, i) => [name, found[i]]));
      const first = found.find(Boolean);
      if (!first || x >= first.width || y >= first.height) return [];
      const names = data.channels[stage.name] || [];
      const { renderers, ours, theirs } = context;
      const value = (name, channel) => {
        const image = byName.get(name);
        return image && channel < image.channels && x < image.width && y < image.height ? image.values[(y * image.width + x) * image.channels + channel] : null;
      };
      return Array.from({ length: first.channels }, (_, channel) => {
        const [mine, other] = [value(ours, channel), value(theirs, channel)];
        const both = mine !== null && other !== null;
        const gap = both ? rayproof.distance(context.metric, mine, other) : null;
        return e("tr", { class: stage.name === context.stage ? "current" : "" },
          e("th", { scope: "row" }, channel ? e("span", { class: "offscreen" }, stage.name) : stage.name,
            e("span", { class: "muted" }, names[channel] === stage.name ? "" : ` ${names[channel] ?? channel}`)),
          renderers.map((name) => {
            const one = value(name, channel);
            return e("td", { class: "figure", "data-renderer": name, "data-stage": stage.name, "data-channel": channel }, one === null ? "" : rayproof.exact(one));
          }),
          e("td", { class: `figure${gap ? " differs" : ""}` }, both ? rayproof.short(gap) : ""));
      });
    }

    // Ours and the reference chosen come first, then everybody else.
    function set(more) {
      context = { ...context, ...more };
      context.metric = rayproof.ofValues(context.metric);
      const chosen = [context.ours, context.theirs].filter((name) => data.renderers.includes(name));
      context.renderers = [...new Set([...chosen, ...data.renderers])];
      rayproof.replace(head, e("tr", {}, e("th", { scope: "col" }, "stage"), context.renderers.map((name) => e("th", { scope: "col" }, name)),
        e("th", { scope: "col" }, context.metric)));
      if (wanted) show(...wanted);
    }

    async function show(x, y) {
      wanted = [x, y];
      if (!images) images = await read();
      if (wanted[0] !== x || wanted[1] !== y) return;
      rayproof.replace(title, `column ${x}, row ${y}`);
      rayproof.replace(command, rayproof.command(rayproof.probeCommand(data, x, y)));
      const own = rayproof.configurationOf(context.ours || "") === data.masks?.configuration;
      const edges = own ? rayproof.kindsAt(data.mask, data.masks.width, x, y) : [];
      rayproof.replace(kinds, edges.length ? `Near an edge, where rounding may decide: ${edges.map(({ name }) => name).join(", ")}.` : "");
      rayproof.replace(body, stages.map((stage, i) => rows(stage, images[i], x, y)));
    }
    return { node, show, set };
  };

  // A user's own scene has no name that would find it, only a file: the last word of the command that runs it.
  rayproof.probeCommand = function (data, x, y) {
    const file = /^rayproof run (.+\.json'?)(?: |$)/.exec(data.reproduce || "");
    return `rayproof probe ${file ? file[1] : rayproof.quoted(data.name)} ${x} ${y}`;
  };

  // A shell word: quoted where a shell would read anything into it.
  rayproof.quoted = (word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`);
})(window.rayproof);
