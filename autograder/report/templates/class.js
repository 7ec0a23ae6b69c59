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
    if (body.parentElement === students && !all.hidden) show();
  });
}
const search = document.getElementById("search");
const students = document.getElementById("students");
const all = document.getElementById("all");
let most = Number(students.dataset.most);  // a browser needs seconds to lay out thousands of rows
function show() {
  const wanted = search.value.toLocaleLowerCase();
  let found = 0;
  for (const row of students.tBodies[0].rows) {
    const fits = row.textContent.toLocaleLowerCase().includes(wanted);
    found += fits ? 1 : 0;
    row.hidden = !fits || found > most;
  }
  all.hidden = found <= most;
  document.getElementById("shown").textContent = all.hidden ? `${found} shown` : `${most} of ${found} shown`;
}
search.addEventListener("input", show);
all.addEventListener("click", () => {
  most = Infinity;
  show();
});
window.addEventListener("beforeprint", () => all.click());
