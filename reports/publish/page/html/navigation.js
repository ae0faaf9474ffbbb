// Pages beside the front page. A script adds one by rayproof.addPage; it shows in the navigation where it has something.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;

  rayproof.pages = new Map();

  // has(results) -> whether there is anything to show; view(results) -> a node. Its address is #page=name.
  rayproof.addPage = (name, { title, has, view }) => rayproof.pages.set(name, { title, has, view });

  rayproof.navigation = function (results, current) {
    const pages = [...rayproof.pages].filter(([, page]) => page.has(results));
    if (!pages.length) return null;
    const link = (name, title) => e("a", { href: name ? rayproof.link({ page: name }) : "#", "aria-current": name === current ? "page" : null }, title);
    return e("nav", { class: "pages", "aria-label": "Pages" }, link("", "Cases"), pages.map(([name, page]) => link(name, page.title)));
  };

  rayproof.title = function (results, wanted) {
    const loud = results.shouts.length ? "! " : "";
    return `${loud}rayproof: ${wanted.case ?? rayproof.pages.get(wanted.page)?.title ?? results.verdict ?? "report"}`;
  };
})(window.rayproof);
