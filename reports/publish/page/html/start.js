// Reads the results and shows what the address asks for: a case, a page, or the front.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const results = JSON.parse(document.getElementById("results").textContent);
  const app = document.getElementById("app");
  rayproof.words = results.examined?.words;
  rayproof.displayNames = results.display_names || {};
  rayproof.terms = new Set((results.terms || []).map(([word]) => word));
  let turn = 0, list = null;

  function front() {
    rayproof.listAddress = location.hash;
    list = rayproof.caseList(results);
    const bad = results.cases.some(rayproof.bad);
    const sheet = rayproof.contactSheet(results, { open: !bad });
    rayproof.keys([
      ["[", "contact sheet: previous stage", () => sheet.turn(-1)], ["]", "contact sheet: next stage", () => sheet.turn(1)],
      ["/", "search the cases", () => list.search()],
      [["j", "k"], "next or previous case of the list", (key) => list.step(key === "j" ? 1 : -1)],
      ["Enter", "on a case: open it"],
      ["Escape", "clear the filters", () => list.clear()],
    ]);
    return e("main", {}, rayproof.shoutBars(results), rayproof.navigation(results, ""), rayproof.verdictLine(results), rayproof.remarks(results),
      rayproof.comparison(results), rayproof.worse(results),
      // First what is wrong: its cause, the worst pair, and others by cause. Where nothing is, a look at all of it.
      rayproof.blamed(results), bad ? rayproof.differences(results) : sheet.node,
      rayproof.ledger(results, (verdict) => list.set({ verdict })), bad ? sheet.node : null,
      rayproof.coverage(results, (id) => list.set({ id })), list.section,
      rayproof.commonFactors(results), rayproof.review(results), rayproof.tradeoff(results), rayproof.slowest(results), rayproof.environment(results));
  }

  function page(name) {
    rayproof.keys([["Escape", "back to the front page", () => { location.hash = ""; }]]);
    const found = rayproof.pages.get(name);
    if (!found) return problem(`There is no page called ${name}.`);
    if (!found.has(results)) return problem(`${found.title}: this report has no data for it.`);
    return e("main", { class: "page" }, rayproof.shoutBars(results), rayproof.navigation(results, name), found.view(results));
  }

  async function oneCase(name) {
    const at = results.cases.findIndex((item) => item.name === name);
    if (at < 0) return { node: problem(`There is no case called ${name}.`), keys: [["Escape", "back to all cases", () => { location.hash = rayproof.listAddress || ""; }]] };
    if (results.alone && !rayproof.inlined(results.cases[at].file)) return { node: problem("This file holds what fails and the worst cases. The others are in index.html of the run's folder, and in this file after", rayproof.command("rayproof report FOLDER --single-file --all")),
      keys: [["Escape", "back to all cases", () => { location.hash = rayproof.listAddress || ""; }]] };
    // Neighbours are those of the list as it was filtered and sorted.
    const order = list ? list.rows() : results.cases;
    const place = order.indexOf(results.cases[at]);
    await rayproof.complete(results.cases[at]);
    return rayproof.caseView(results, results.cases[at], { before: order[place - 1], after: place < 0 ? undefined : order[place + 1] });
  }

  async function show() {
    // A change that the page made itself is already on the screen.
    if (rayproof.quiet === location.hash) return;
    rayproof.quiet = null;
    const mine = (turn += 1);
    const wanted = rayproof.address();
    const asked = location.hash;
    let view;
    try {
      if (wanted.case !== undefined) view = await oneCase(wanted.case);
      else view = { node: wanted.page ? page(wanted.page) : front() };
    } catch (error) {
      view = { node: problem(error.message), keys: [] };
    }
    // Another case was opened while this one was loading.
    if (mine !== turn) return;
    if (view.keys) rayproof.keys(view.keys);
    document.title = rayproof.title(results, wanted);
    rayproof.replace(app, view.node);
    // Whoever drives the page can see which address is on the screen: a case's data is loaded after the address has changed.
    app.dataset.shown = asked;
    view.shown?.();
    list?.laid();
    window.scrollTo(0, 0);
  }

  const problem = (text, more = null) => e("main", {}, e("p", { class: "shout", role: "alert" }, text), more, e("p", {}, e("a", { href: "#" }, "\u2190 all cases")));

  window.addEventListener("hashchange", () => {
    const { case: name, page: other } = rayproof.address();
    if (name === undefined && other === undefined) rayproof.listAddress = location.hash;
    show();
  });
  rayproof.rows(results).then((rows) => {
    results.cases = rows;
    show();
  });
})(window.rayproof);
