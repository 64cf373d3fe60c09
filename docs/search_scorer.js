// Pages that answer a question come before those that list everything. The numbers but the last
// are Sphinx's own; its script declares the same name again, so this one is a var.
const preferred = (name, kind) => {
  if (/^(changelog|names|releases\/)/.test(name)) return -4;
  if (/^(api|gallery)\//.test(name)) return kind === "object" ? 0 : -2;
  return name.startsWith("tutorials/") ? 3 : 1;
};

var Scorer = {
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
  score: ([name, , , , score, , kind]) => score + preferred(name, kind),
};
