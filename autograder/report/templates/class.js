"use strict";
// Sorts a table by a column, as numbers if all values are numbers, and shows only rows that contain the search text.
for (const button of document.querySelectorAll("th button")) {
  button.addEventListener("click", () => {
    const heading = button.parentElement;
    const body = heading.closest("table").tBodies[0];
    const column = heading.cellIndex;
    const up = heading.getAttribute("aria-sort") !== "ascending";
    const value = row => row.cells[column].dataset.value ?? row.cells[column].textContent.trim();
    const rows = [...body.rows];
    const numbers = rows.every(row => value(row) === "" || !Number.isNaN(Number(value(row))));
    const order = (one, other) => numbers
      ? Number(value(one)) - Number(value(other))
      : value(one).localeCompare(value(other), undefined, { numeric: true });
    rows.sort((one, other) => up ? order(one, other) : order(other, one));
    body.append(...rows);
    for (const other of heading.parentElement.cells) other.removeAttribute("aria-sort");
    heading.setAttribute("aria-sort", up ? "ascending" : "descending");
  });
}
const search = document.getElementById("search");
search.addEventListener("input", () => {
  const wanted = search.value.toLocaleLowerCase();
  let shown = 0;
  for (const row of document.getElementById("students").tBodies[0].rows) {
    row.hidden = !row.textContent.toLocaleLowerCase().includes(wanted);
    shown += row.hidden ? 0 : 1;
  }
  document.getElementById("shown").textContent = `${shown} shown`;
});
