const byId = id => document.getElementById(id);
const make = (tag, text, parent) => { const e = document.createElement(tag); if (text !== undefined) e.textContent = text; if (parent) parent.append(e); return e; };
const svgMake = (tag, attributes, parent, text) => { const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [k, v] of Object.entries(attributes)) e.setAttribute(k, v); if (text !== undefined) e.textContent = text; if (parent) parent.append(e); return e; };
const sum = list => list.reduce((a, b) => a + b, 0);
const percent = (x, digits = 1) => (100 * x).toFixed(digits) + " %";

function table(parent, heads, rows, onRow) {
  const t = make("table", undefined, parent), head = make("tr", undefined, make("thead", undefined, t)), body = make("tbody", undefined, t);
  let sorted = -1, sign = -1;
  const show = () => { body.replaceChildren(); for (const row of rows) { const tr = make("tr", undefined, body);
    row.cells.forEach(c => make("td", typeof c === "number" && !Number.isInteger(c) ? c.toFixed(3) : c, tr));
    if (onRow) { tr.style.cursor = "pointer"; tr.onclick = () => onRow(row); } } };
  heads.forEach((h, i) => make("th", h, head).onclick = () => { sign = sorted === i ? -sign : -1; sorted = i;
    rows.sort((a, b) => (a.cells[i] < b.cells[i] ? -1 : a.cells[i] > b.cells[i] ? 1 : 0) * sign); show(); });
  show();
}

/// The take's phones and words below a plot of that height; time begins at `left`, a second is `px` wide.
function drawLabels(svg, take, left, px, height) {
  let start = take.start_s;
  for (const [name, end] of take.phones) { svgMake("line", {x1: left + px * end, x2: left + px * end, y1: 18, y2: height + 22, stroke: "var(--line)", "stroke-dasharray": "2 3"}, svg);
    svgMake("text", {x: left + px * (start + end) / 2, y: height + 16, "text-anchor": "middle"}, svg, name); start = end; }
  for (const [text, from, to] of take.words) { svgMake("rect", {x: left + px * from, y: height + 24, width: Math.max(1, px * (to - from) - 1), height: 16, fill: "var(--mark)", "fill-opacity": 0.15}, svg);
    svgMake("text", {x: left + px * (from + to) / 2, y: height + 36, "text-anchor": "middle"}, svg, text); }
}
