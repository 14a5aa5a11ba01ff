/* Charts of the report: plain SVG with zoom, hover and keyboard; no library, no network. */
(() => {
  "use strict";
  const SVG = "http://www.w3.org/2000/svg";
  const LEFT = 62, RIGHT = 14, TOP = 10, GAP = 20, BOTTOM = 40;
  const source = document.getElementById("data");
  if (!source) return;
  const data = JSON.parse(source.textContent);
  const views = [], zoom = {}, hidden = new Set();

  const element = (name, attributes = {}, parent = null, text = null) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== null) made.textContent = text;
    if (parent) parent.appendChild(made);
    return made;
  };
  const show = (value) => {
    if (!Number.isFinite(value)) return "–";
    const digits = Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : Math.abs(value) >= 1 ? 2 : 3;
    return Number(value.toFixed(digits)).toString().replace("-", "−");
  };
  const steps = (low, high, count, isHours, isCount) => {
    const raw = (high - low) / Math.max(count, 1);
    const power = 10 ** Math.floor(Math.log10(raw));
    let step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw);
    if (isCount) step = Math.max(1, step);
    if (isHours && raw > 0.9) step = [1, 2, 3, 6, 12, 24, 48, 96, 168].find((k) => k >= raw) || step;
    const ticks = () => {
      const found = [];
      for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) found.push(k * step);
      return found;
    };
    if (ticks().length < 3 && !isHours && !isCount) step /= 2;
    return ticks();
  };
  const nearest = (xs, x) => {
    let low = 0, high = xs.length - 1;
    while (high - low > 1) { const mid = (low + high) >> 1; if (xs[mid] < x) low = mid; else high = mid; }
    return Math.abs(xs[low] - x) <= Math.abs(xs[high] - x) ? low : high;
  };
  const visible = (series) => !hidden.has(series.name);

  const PRINTED = 680;  // px of a chart as wide as a sheet of paper
  let printing = false;

  class View {
    constructor(figure, chart) {
      this.figure = figure; this.chart = chart; this.cursor = null;
      this.box = figure.querySelector(".plot");
      this.readout = figure.querySelector(".readout");
      this.reset = figure.querySelector(".reset");
      this.key = chart.group || chart.key;
      const all = chart.panels.flatMap((p) => p.series.map((s) => ({ ...s, xs: data.arrays[s.x] })));
      this.panels = chart.panels.map((p) => ({ ...p, series: p.series.map((s) => ({ ...s, xs: data.arrays[s.x] })) }));
      const bars = all.filter((s) => s.kind === "bars");
      const pad = bars.length && bars[0].xs.length > 1 ? (bars[0].xs[1] - bars[0].xs[0]) / 2 : 0;
      const ends = all.filter((s) => s.xs.length);
      this.full = [Math.min(...ends.map((s) => s.xs[0])) - pad, Math.max(...ends.map((s) => s.xs[s.xs.length - 1])) + pad];
      if (!(this.full[1] > this.full[0])) this.full = [this.full[0] - 1, this.full[0] + 1];
      this.listen();
    }
    get domain() { return zoom[this.key] || this.full; }
    at(x) { const [a, b] = this.domain; return LEFT + ((x - a) / (b - a)) * (this.width - LEFT - RIGHT); }
    from(pixel) { const [a, b] = this.domain; return a + ((pixel - LEFT) / (this.width - LEFT - RIGHT)) * (b - a); }

    draw() {
      const width = printing ? (this.figure.closest(".grid-2, .grid-3") && !this.figure.matches(".solid") ? PRINTED / 2 : PRINTED) : this.box.clientWidth;
      if (!width) return;
      this.width = Math.max(width, 260);
      const small = Boolean(this.figure.closest(".small"));
      const heights = this.panels.map((_, i) => (small ? 150 : i ? 110 : 210));
      this.height = TOP + heights.reduce((a, b) => a + b, 0) + GAP * (heights.length - 1) + BOTTOM;
      const svg = element("svg", { viewBox: `0 0 ${this.width} ${this.height}`, "aria-hidden": "true", focusable: "false" });
      let top = TOP;
      this.areas = this.panels.map((panel, i) => {
        const area = { panel, top, height: heights[i], last: i === heights.length - 1 };
        this.panel(svg, area);
        top += heights[i] + GAP;
        return area;
      });
      element("text", { class: "label", x: (LEFT + this.width - RIGHT) / 2, y: this.height - 4, "text-anchor": "middle" }, svg, this.chart.x);
      this.layer = element("g", { class: "cursor" }, svg);
      this.brush = element("rect", { class: "brush", y: TOP, height: this.height - TOP - BOTTOM, width: 0, x: 0 }, svg);
      this.box.replaceChildren(svg);
      this.reset.hidden = !zoom[this.key];
    }
    range(panel) {
      const [a, b] = this.domain;
      let low = Infinity, high = -Infinity;
      for (const s of panel.series.filter(visible)) {
        const lows = s.low || s.y, highs = s.high || s.y;
        for (let i = 0; i < s.xs.length; i++) {
          if (s.xs[i] < a || s.xs[i] > b) continue;
          if (lows[i] < low) low = lows[i];
          if (highs[i] > high) high = highs[i];
        }
      }
      if (panel.zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
      if (!Number.isFinite(low)) return [-1, 1];
      const pad = (high - low) * 0.06 || Math.abs(high) * 0.1 || 1;
      return [low - pad, high + pad];
    }
    panel(svg, area) {
      const { panel, top, height } = area, [low, high] = this.range(panel), bottom = top + height;
      area.y = (value) => bottom - ((value - low) / (high - low)) * height;
      const clip = `clip-${this.chart.key}-${top}`.replace(/[^A-Za-z0-9-]/g, "_");
      const rect = element("rect", { x: LEFT, y: top, width: this.width - LEFT - RIGHT, height }, element("clipPath", { id: clip }, svg));
      rect.setAttribute("class", "clip");
      for (const [from, to, why] of this.chart.shades) {
        const x1 = Math.max(this.at(from), LEFT), x2 = Math.min(this.at(to), this.width - RIGHT);
        if (x2 > x1) element("title", {}, element("rect", { class: "shade", x: x1, y: top, width: x2 - x1, height }, svg), why);
      }
      for (const tick of steps(low, high, Math.max(4, height / 42), false)) {
        const y = area.y(tick);
        element("line", { class: Math.abs(tick) < 1e-12 && panel.zero ? "zero" : "grid", x1: LEFT, x2: this.width - RIGHT, y1: y, y2: y }, svg);
        element("text", { class: "tick", x: LEFT - 7, y: y + 4, "text-anchor": "end" }, svg, show(tick));
      }
      for (const tick of steps(...this.domain, (this.width - LEFT - RIGHT) / 55, this.chart.x.includes("[h]"), /\[(-|readings)\]/.test(this.chart.x))) {
        const x = this.at(tick);
        element("line", { class: "grid", x1: x, x2: x, y1: top, y2: bottom }, svg);
        if (area.last) element("text", { class: "tick", x, y: bottom + 17, "text-anchor": "middle" }, svg, show(tick));
      }
      const inside = element("g", { "clip-path": `url(#${clip})` }, svg);
      for (const s of panel.series.filter(visible)) this.series(inside, s, area);
      for (const [name, x] of Object.entries(this.chart.marks)) {
        element("line", { class: "mark", x1: this.at(x), x2: this.at(x), y1: top, y2: bottom }, svg);
        element("text", { class: "tick", x: this.at(x) + 5, y: top + 14 }, svg, name);
      }
      element("rect", { class: "frame", x: LEFT, y: top, width: this.width - LEFT - RIGHT, height }, svg);
      const middle = top + height / 2;
      element("text", { class: "label", x: 13, y: middle, "text-anchor": "middle", transform: `rotate(-90 13 ${middle})` }, svg, panel.label);
    }
    series(parent, s, area) {
      const y = area.y, look = `c-${s.color} ${s.kind}${area.panel.zero ? " below" : ""}`;
      const path = (ys) => s.xs.map((x, i) => `${this.at(x).toFixed(1)},${y(ys[i]).toFixed(1)}`);
      if (s.kind === "band") element("polygon", { class: look, points: [...path(s.low), ...path(s.high).reverse()].join(" ") }, parent);
      else if (s.kind === "points") {
        const size = s.xs.length > 700 ? 1.3 : 1.9;
        const d = path(s.y).map((p) => { const [a, b] = p.split(","); return `M${a - size},${b}a${size},${size} 0 1,0 ${2 * size},0a${size},${size} 0 1,0 ${-2 * size},0`; });
        element("path", { class: look, d: d.join("") }, parent);
      } else if (s.kind === "bars") {
        const wide = Math.max(2, 0.6 * Math.abs(this.at(s.xs[1] ?? s.xs[0] + 1) - this.at(s.xs[0])));
        s.xs.forEach((x, i) => element("rect", { class: look, x: this.at(x) - wide / 2, width: wide, y: Math.min(y(0), y(s.y[i])), height: Math.abs(y(0) - y(s.y[i])) }, parent));
      } else element("polyline", { class: look, points: path(s.y).join(" ") }, parent);
    }
    point(x, spoken) {
      if (!this.layer) return;
      const lead = this.panels[0].series.filter((s) => visible(s) && s.xs.length && s.kind !== "band");
      if (!lead.length) return;
      x = lead[0].xs[nearest(lead[0].xs, x)];
      this.cursor = x;
      this.layer.replaceChildren();
      element("line", { x1: this.at(x), x2: this.at(x), y1: TOP, y2: this.height - BOTTOM }, this.layer);
      const said = [`${this.chart.x.split(" [")[0]} ${show(x)} ${(/\[(.*)\]/.exec(this.chart.x) || ["", ""])[1]}`];
      for (const area of this.areas) {
        const parts = [];
        for (const s of area.panel.series.filter((s) => visible(s) && s.xs.length && s.kind !== "band")) {
          const i = nearest(s.xs, x);
          element("circle", { class: `c-${s.color}`, cx: this.at(s.xs[i]), cy: area.y(s.y[i]), r: 3.6 }, this.layer);
          parts.push(`${s.name} ${show(s.y[i])}`);
        }
        said.push(`${area.panel.label}: ${parts.join(", ")}`);
      }
      this.readout.setAttribute("aria-live", spoken ? "polite" : "off");
      this.readout.textContent = said.join(" · ");
    }
    zoomTo(domain) {
      if (domain) {
        const [a, b] = [Math.max(domain[0], this.full[0]), Math.min(domain[1], this.full[1])];
        if (b - a < (this.full[1] - this.full[0]) * 1e-4) return;
        zoom[this.key] = [a, b];
      } else delete zoom[this.key];
      for (const view of views) if (view.key === this.key) view.draw();
    }
    listen() {
      let start = null;
      const pixel = (event) => event.clientX - this.box.getBoundingClientRect().left;
      this.box.addEventListener("pointerdown", (event) => { if (event.button === 0) { start = pixel(event); this.box.setPointerCapture(event.pointerId); } });
      this.box.addEventListener("pointermove", (event) => {
        const x = pixel(event);
        if (start !== null && Math.abs(x - start) > 4) {
          this.brush.setAttribute("x", Math.min(x, start)); this.brush.setAttribute("width", Math.abs(x - start));
        } else this.point(this.from(x), false);
      });
      this.box.addEventListener("pointerup", (event) => {
        const x = pixel(event);
        if (start !== null && Math.abs(x - start) > 8) this.zoomTo([this.from(Math.min(x, start)), this.from(Math.max(x, start))]);
        start = null;
      });
      this.box.addEventListener("pointercancel", () => { start = null; if (this.brush) this.brush.setAttribute("width", 0); });
      this.box.addEventListener("dblclick", () => this.zoomTo(null));
      this.reset.addEventListener("click", () => { this.zoomTo(null); this.box.focus(); });
      this.box.addEventListener("keydown", (event) => {
        const [a, b] = this.domain, span = b - a, here = this.cursor ?? (a + b) / 2;
        const lead = this.panels[0].series[0].xs, index = nearest(lead, here);
        const moves = {
          ArrowLeft: () => (event.shiftKey ? this.zoomTo([a - span / 4, b - span / 4]) : this.point(lead[Math.max(0, index - 1)], true)),
          ArrowRight: () => (event.shiftKey ? this.zoomTo([a + span / 4, b + span / 4]) : this.point(lead[Math.min(lead.length - 1, index + 1)], true)),
          Home: () => this.point(a, true), End: () => this.point(b, true),
          "+": () => this.zoomTo([here - span / 4, here + span / 4]),
          "-": () => (span * 2 >= this.full[1] - this.full[0] ? this.zoomTo(null) : this.zoomTo([here - span, here + span])),
          0: () => this.zoomTo(null), Escape: () => this.zoomTo(null),
        };
        const act = moves[event.key === "=" ? "+" : event.key];
        if (act) { event.preventDefault(); act(); if (this.cursor !== null) this.point(this.cursor, true); }
      });
    }
  }

  const fit = () => {  // equations that are wider than the window get smaller, down to what can be read
    for (const one of document.querySelectorAll(".equation, div.formula")) {
      const math = one.querySelector("math");
      math.style.fontSize = "";
      const share = one.clientWidth / one.scrollWidth;
      if (share < 1) math.style.fontSize = `${Math.max(0.97 * share, 0.55) * parseFloat(getComputedStyle(math).fontSize)}px`;
    }
  };
  const drawAll = () => { fit(); views.forEach((view) => view.draw()); };
  for (const figure of document.querySelectorAll("figure[data-chart]")) {
    const chart = data.charts.find((one) => one.key === figure.dataset.chart);
    if (chart) views.push(new View(figure, chart));
  }
  for (const button of document.querySelectorAll("button[data-series]")) {
    button.addEventListener("click", () => {
      const name = button.dataset.series, on = hidden.has(name);
      if (on) hidden.delete(name); else hidden.add(name);
      for (const same of document.querySelectorAll("button[data-series]")) if (same.dataset.series === name) same.setAttribute("aria-pressed", on);
      drawAll();
    });
  }
  for (const button of document.querySelectorAll('button[data-series][aria-pressed="false"]')) hidden.add(button.dataset.series);
  for (const choice of document.querySelectorAll("input[data-shows]")) {
    const apply = () => {
      for (const one of document.querySelectorAll(`input[name="${choice.name}"]`)) document.getElementById(one.dataset.shows).classList.toggle("off", !one.checked);
      drawAll();
    };
    choice.addEventListener("change", apply);
    if (choice.checked) apply();
  }
  const list = document.getElementById("recording"), find = document.getElementById("find");
  if (list) {
    const all = [...list.options];
    const apply = () => {
      for (const one of all) document.getElementById(one.value).classList.toggle("off", one.value !== list.value);
      drawAll();
    };
    list.addEventListener("change", apply);
    find.addEventListener("input", () => {
      const fitting = all.filter((one) => one.text.toLowerCase().includes(find.value.trim().toLowerCase()));
      if (!fitting.length) return;
      const chosen = fitting.find((one) => one.value === list.value) || fitting[0];
      list.replaceChildren(...fitting);
      list.value = chosen.value;
      apply();
    });
    apply();
  }
  const follow = () => {  // a link into a chart of a recording that is not shown
    const aim = location.hash.length > 1 && document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const group = aim && aim.closest("[id^='rec-']");
    if (!group || !group.classList.contains("off")) return;
    const radio = document.querySelector(`input[data-shows="${group.id}"]`);
    if (radio) { radio.checked = true; radio.dispatchEvent(new Event("change")); }
    else if (list) { find.value = ""; find.dispatchEvent(new Event("input")); list.value = group.id; list.dispatchEvent(new Event("change")); }
    aim.scrollIntoView();
  };
  window.addEventListener("hashchange", follow);
  const save = (name, content) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([content], { type: "text/plain;charset=utf-8" }));
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  };
  const forms = {
    // a byte order mark, so that Excel reads the units; a minus that programs read
    CSV: (rows) => "\ufeff" + rows.map((row) => row.map((cell) => cell.replaceAll("−", "-")).map((cell) => (/[",\n]/.test(cell) ? `"${cell.replaceAll('"', '""')}"` : cell)).join(",")).join("\n") + "\n",
    LaTeX: (rows) => {
      const safe = (cell) => cell.replace(/[\\&%$#_{}~^]/g, (c) => ({ "\\": "\\textbackslash{}", "~": "\\textasciitilde{}", "^": "\\textasciicircum{}" })[c] || `\\${c}`)
        .replaceAll("µ", "\\textmu{}").replaceAll("°", "\\textdegree{}").replaceAll("−", "$-$").replaceAll("→", "$\\to$").replaceAll("–", "--")
        .replace(/[⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+/g, (run) => `$^{${[...run].map((c) => "-0123456789"["⁻⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c)]).join("")}}$`)
        .replace(/[·×±σ\u00a0“”]/g, (c) => ({ "·": "$\\cdot$", "×": "$\\times$", "±": "$\\pm$", "σ": "$\\sigma$", "\u00a0": "~", "“": "``", "”": "''" })[c]);
      const line = (row) => `${row.map(safe).join(" & ")} \\\\`;
      return ["\\begin{tabular}{l" + "r".repeat(rows[0].length - 1) + "}", "\\hline", line(rows[0]), "\\hline", ...rows.slice(1).map(line), "\\hline", "\\end{tabular}", ""].join("\n");
    },
  };
  for (const table of document.querySelectorAll(".scroll > table")) {
    const caption = table.caption, title = caption ? caption.textContent.trim() : "table";
    if (!caption || !table.tHead) continue;
    const tools = document.createElement("span");
    tools.className = "tools";
    for (const [form, write] of Object.entries(forms)) {
      const button = document.createElement("button");
      button.type = "button"; button.textContent = form;
      button.setAttribute("aria-label", `Save as ${form}: ${title}`);
      button.addEventListener("click", () => {
        const part = (node) => (node.nodeName === "BR" ? " · " : node.textContent);
        const text = (cell) => cell.dataset.text ?? [...cell.childNodes].map(part).join("").replace(/\s+/g, " ").trim();
        const rows = [...table.rows].map((row) => [...row.cells].map(text));
        const file = title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-|-$/g, "").slice(0, 60);
        save(`${file}.${form === "CSV" ? "csv" : "tex"}`, write(rows));
      });
      tools.append(button);
    }
    caption.append(tools);
  }
  for (const table of document.querySelectorAll("table[data-against]")) {  // compare with a row, find rows, sort them
    const { columns, heads, cells, texts } = JSON.parse(table.dataset.against), rows = [...table.tBodies[0].rows];
    const name = (row) => (row.cells[0].querySelector("a") || row.cells[0].firstChild).textContent.trim();
    const head = [...table.tHead.rows[0].cells].map((cell) => {
      const button = document.createElement("button");
      button.type = "button"; button.className = "sort"; button.append(...cell.childNodes);
      cell.append(button);
      button.addEventListener("click", () => {
        const up = cell.getAttribute("aria-sort") !== "ascending", at = cell.cellIndex;
        const key = (row) => { const text = row.cells[at].textContent.trim().replace("−", "-"); return [parseFloat(text), text]; };
        const order = (a, b) => {
          const [x, s] = key(a), [y, t] = key(b);
          return Number.isNaN(x) || Number.isNaN(y) ? Number.isNaN(x) - Number.isNaN(y) || s.localeCompare(t) : x - y;
        };
        for (const one of table.tHead.rows[0].cells) one.removeAttribute("aria-sort");
        cell.setAttribute("aria-sort", up ? "ascending" : "descending");
        table.tBodies[0].append(...[...rows].sort((a, b) => (up ? order(a, b) : order(b, a))));
      });
      return button;
    });
    const first = [[...head], ...rows.map((row) => row.cells)].map((cells) => columns.map((column) => cells[column].textContent));
    const tools = table.caption.querySelector(".tools"), label = document.createElement("label"), choice = document.createElement("select");
    label.className = "find"; label.append("Compare with ", choice);
    rows.forEach((row) => choice.add(new Option(name(row))));
    choice.addEventListener("change", () => {
      const chosen = choice.selectedIndex, said = heads.map((head) => (chosen ? head.replace("{}", choice.value) : null));
      columns.forEach((column, k) => {
        head[column].textContent = said[k] ?? first[0][k];
        rows.forEach((row, r) => {
          row.cells[column].textContent = chosen ? texts[cells[chosen][r][k]] : first[r + 1][k];
          row.cells[column].dataset.label = said[k] ?? first[0][k];
        });
      });
    });
    tools.prepend(label);
    if (rows.length > 8) {
      const search = document.createElement("label"), text = document.createElement("input");
      text.type = "search"; search.className = "find"; search.append("Find ", text);
      text.addEventListener("input", () => {
        const wanted = text.value.trim().toLowerCase().split(/\s+/);
        rows.forEach((row) => { row.hidden = !wanted.every((word) => row.textContent.toLowerCase().includes(word)); });
      });
      tools.prepend(search);
    }
  }
  const theme = document.getElementById("theme");
  if (theme) theme.addEventListener("click", () => {
    const chosen = document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
    document.documentElement.dataset.theme = chosen === "dark" ? "light" : "dark";
  });
  let last = 0;
  new ResizeObserver(() => { const now = document.body.clientWidth; if (now !== last) { last = now; drawAll(); } }).observe(document.body);
  window.addEventListener("beforeprint", () => {
    const off = [...document.querySelectorAll(".off")];
    const shut = [...document.querySelectorAll("details:not([open])")];
    off.forEach((one) => one.classList.remove("off"));
    shut.forEach((one) => { one.open = true; });
    printing = true;  // the window may be wider or narrower than paper
    drawAll();
    const back = () => { printing = false; off.forEach((one) => one.classList.add("off")); shut.forEach((one) => { one.open = false; }); drawAll(); };
    window.addEventListener("afterprint", back, { once: true });
  });
  for (const details of document.querySelectorAll("details")) details.addEventListener("toggle", drawAll);
  drawAll();
  follow();
})();
