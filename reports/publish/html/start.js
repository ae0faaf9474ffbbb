// Reads the results and shows what the address asks for.
(function (rayproof) {
  "use strict";
  const e = rayproof.element;
  const results = JSON.parse(document.getElementById("results").textContent);
  const app = document.getElementById("app");
  let turn = 0;

  function front() {
    rayproof.listAddress = location.hash;
    const list = rayproof.caseList(results);
    return e("main", {}, rayproof.shoutBars(results), rayproof.verdictLine(results),
      rayproof.ledger(results, (verdict) => list.set({ verdict })), rayproof.blamed(results),
      rayproof.audit(results),
      rayproof.coverage(results, (id) => list.set({ id })), list.section,
      rayproof.review(results), rayproof.tradeoff(results), rayproof.slowest(results), rayproof.environment(results));
  }

  async function show() {
    // A change that the page made itself is already on the screen.
    if (rayproof.quiet === location.hash) return;
    rayproof.quiet = null;
    const mine = (turn += 1);
    const wanted = rayproof.address().case;
    if (wanted === undefined) {
      rayproof.replace(app, front());
      return;
    }
    const row = results.cases.find((item) => item.name === wanted);
    let view;
    try {
      view = row ? await rayproof.caseView(results, row) : problem(`There is no case called ${wanted}.`);
    } catch (error) {
      view = problem(error.message);
    }
    // Another case was opened while this one was loading.
    if (mine !== turn) return;
    rayproof.replace(app, view);
    window.scrollTo(0, 0);
  }

  const problem = (text) => e("main", {}, e("p", { class: "shout" }, text), e("p", {}, e("a", { href: "#" }, "\u2190 all cases")));

  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && rayproof.address().case !== undefined) location.hash = rayproof.listAddress || "";
  });
  window.addEventListener("hashchange", () => {
    if (rayproof.address().case === undefined) rayproof.listAddress = location.hash;
    show();
  });
  show();
})(window.rayproof);
