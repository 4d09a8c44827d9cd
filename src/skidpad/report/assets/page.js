// Sortable tables: click or press Enter on a heading.
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = [...table.tHead.rows[0].cells];
  heads.forEach((head, column) => {
    head.tabIndex = 0;
    const sort = () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      heads.forEach(h => h.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const key = row => {
        const c = row.cells[column], v = c.dataset.sort ?? c.textContent.trim();
        return v !== "" && isFinite(v) ? Number(v) : v;
      };
      const rank = v => typeof v === "number" ? 0 : v === "" ? 2 : 1;
      const rows = [...table.tBodies[0].rows].sort((r, s) => {
        const a = key(r), b = key(s);
        if (rank(a) !== rank(b)) return rank(a) - rank(b);
        const order = typeof a === "number" ? a - b : String(a).localeCompare(String(b));
        return down ? -order : order;
      });
      table.tBodies[0].append(...rows);
    };
    head.addEventListener("click", sort);
    head.addEventListener("keydown", e => { if (e.key === "Enter") sort(); });
  });
}
