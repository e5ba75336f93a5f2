// Tables that sort by their columns; that of pairs shows the pair of a row: its picture, its verdict, its pose.
"use strict";
(() => {
  const $ = (id) => document.getElementById(id);
  const { pairs } = (globalThis.report ??= JSON.parse($("data").textContent));
  const body = $("pairs").tBodies[0];
  const calm = matchMedia("(prefers-reduced-motion: reduce)").matches;

  const choose = (number) => {
    const pair = pairs[number];
    for (const marked of document.querySelectorAll("main [data-pair]")) {
      marked.classList.toggle("chosen", Number(marked.dataset.pair) === number);
    }
    for (const button of body.querySelectorAll("button")) {
      button.setAttribute("aria-pressed", String(Number(button.closest("tr").dataset.pair) === number));
    }
    $("chosen").textContent = pair.name;
    $("said").textContent = pair.verdict;
    $("form0").hidden = !pair.pose;
    $("form0").querySelector("pre").textContent = pair.pose;
    if ($("viewer")) {
      $("viewer").hidden = pair.scene === null;
      if (pair.scene !== null) dispatchEvent(new CustomEvent("choose", { detail: pair.scene }));
    }
  };

  const sort = (header) => {
    const table = header.closest("table");
    const column = [...header.parentElement.cells].indexOf(header);
    const way = header.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    for (const other of header.parentElement.cells) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", way === 1 ? "ascending" : "descending");
    const value = (row) => row.cells[column].dataset.value;
    const isNumber = header.classList.contains("number");
    // What has no number comes last, either way.
    const compare = (a, b) => (isNumber
      ? (value(a) === "") - (value(b) === "") || way * (value(a) - value(b))
      : way * value(a).localeCompare(value(b), undefined, { numeric: true }));
    table.tBodies[0].append(...[...table.tBodies[0].rows].sort(compare));
  };

  for (const table of document.querySelectorAll("table.sortable")) {
    table.tHead.addEventListener("click", (event) => {
      const header = event.target.closest("th");
      if (header) sort(header);
    });
  }
  // Only the rows of one word, such as a method.
  $("only")?.addEventListener("change", ({ target }) => {
    for (const row of body.rows) {
      row.hidden = target.value !== "" && ![...row.cells].some((cell) => cell.dataset.value === target.value);
    }
  });
  // Rows of the table, and lines of a graph.
  document.querySelector("main").addEventListener("click", (event) => {
    const marked = event.target.closest("[data-pair]");
    if (!marked) return;
    choose(Number(marked.dataset.pair));
    const { top, bottom } = $("shown").getBoundingClientRect();
    if (top < 0 || bottom > innerHeight + 200 || top > innerHeight / 2) {
      $("shown").scrollIntoView({ behavior: calm ? "auto" : "smooth", block: "start" });
    }
  });
  choose(Math.max(0, pairs.findIndex((pair) => pair.scene !== null)));
})();
