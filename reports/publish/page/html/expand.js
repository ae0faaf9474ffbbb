// The inverse of reports/results/compact.py: derivations back into the checks, and what goes without saying.
(function (rayproof) {
  "use strict";

  const COUNTS = ["interior", "over_inside", "edge", "differ_at_edge", "wrong_at_edge", "in_window", "differ_in_window", "hit_miss", "nan", "inf", "flagged"];

  const completed = (measured) => (measured ? { worst_inside: measured.worst_ratio, ...Object.fromEntries(COUNTS.map((name) => [name, 0])), ...measured } : null);

  rayproof.expanded = function ({ derivations = [], ...record }) {
    const checks = (record.checks || []).map((check) => ({ reason: "", ...check,
      because: typeof check.because === "number" ? derivations[check.because] || "" : check.because,
      end_to_end: completed(check.end_to_end), continued: completed(check.continued) }));
    return { ...record, checks };
  };
})(window.rayproof);
