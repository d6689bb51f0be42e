// The charts and tables of all pages: those of reports, whose numbers lie in the page, and those that a program feeds.
const dgdPage = (() => {
"use strict";
const root = document.documentElement;
const darkness = matchMedia("(prefers-color-scheme: dark)");
const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : darkness.matches);
const css = (name) => getComputedStyle(root).getPropertyValue(name).trim();
const make = (tag, properties = {}) => Object.assign(document.createElement(tag), properties);

// ---- numbers ----

const raised = (n) => String(n).replace(/./g, (c) => (c === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[c]));
// A number with so many decimals, or with a power of ten where it would be long.
function shown(value, decimals) {
  if (value == null || !isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size !== 0 && (size >= 1e6 || size < 1e-4)) {
    const [digits, power] = value.toExponential(Math.max(0, Math.min(6, decimals + Math.floor(Math.log10(size))))).split("e");
    return `${digits.replace("-", "−")}·10${raised(Number(power))}`;
  }
  return value.toFixed(Math.max(0, Math.min(12, decimals))).replace("-", "−");
}
const decimalsOf = (step) => (step > 0 ? Math.ceil(-Math.log10(step) - 1e-9) : 3);

// ---- from the columns of a panel to what uPlot draws ----

const isAscending = (x) => x.every((value, k) => value != null && (k === 0 || value >= x[k - 1]));

// Rows of all tables by their abscissa; one that stands twice in a table is a jump and stays two rows.
function joined(tables) {
  if (tables.every((table) => table.x === tables[0].x)) {
    return [tables[0].x, ...tables.flatMap((table) => table.ys)];
  }
  const at = tables.map(() => 0);
  const rows = [[], ...tables.flatMap((table) => table.ys.map(() => []))];
  for (;;) {
    let next = Infinity;
    tables.forEach((table, i) => { if (at[i] < table.x.length) next = Math.min(next, table.x[at[i]]); });
    if (next === Infinity) return rows;
    rows[0].push(next);
    let column = 1;
    tables.forEach((table, i) => {
      const has = at[i] < table.x.length && table.x[at[i]] === next;
      for (const y of table.ys) rows[column++].push(has ? y[at[i]] : undefined);
      if (has) at[i] += 1;
    });
  }
}

// A table whose rows ascend, without those that have no abscissa.
function sorted(x, y) {
  if (isAscending(x)) return { x, ys: [y] };
  const order = x.map((_, k) => k).filter((k) => x[k] != null).sort((a, b) => x[a] - x[b]);
  return { x: order.map((k) => x[k]), ys: [order.map((k) => y[k])] };
}

function range(values, before = [Infinity, -Infinity]) {
  let [low, high] = before;
  for (const value of values) if (value != null) { if (value < low) low = value; if (value > high) high = value; }
  return [low, high];
}

// ---- plots that are zoomed together ----

const groups = new Map();
function groupOf(link) {
  if (!groups.has(link)) groups.set(link, { plots: new Set(), spans: new Map(), full: null, at: null });
  return groups.get(link);
}
// What all of a group is, by what its figures have; whoever saw all of it still does.
function settle(group) {
  let [low, high] = [Infinity, -Infinity], hasDots = false;
  for (const span of group.spans.values()) {
    [low, high] = [Math.min(low, span.low), Math.max(high, span.high)];
    hasDots ||= span.hasDots;
  }
  if (!(high > low)) {
    const middle = isFinite(low) ? low : 0;
    [low, high] = [middle - 0.5, middle + 0.5];
  }
  // Dots on the border are drawn whole.
  const room = hasDots ? 0.02 * (high - low) : 0;
  const full = [low - room, high + room];
  const sawAll = !group.at || (group.at[0] <= group.full[0] && group.at[1] >= group.full[1]);
  group.full = full;
  const at = sawAll || group.at[0] >= full[1] || group.at[1] <= full[0]
    ? full : [Math.max(group.at[0], full[0]), Math.min(group.at[1], full[1])];
  const moved = !group.at || group.at[0] !== at[0] || group.at[1] !== at[1];
  group.at = [...at];
  if (moved) for (const plot of group.plots) plot.setScale("x", { min: at[0], max: at[1] });
}
function zoom(group, low, high) {
  const [first, last] = group.full;
  const width = Math.min(high - low, last - first);
  if (!(width > (last - first) * 1e-7)) return;
  const from = Math.max(first, Math.min(low, last - width));
  if (group.at[0] === from && group.at[1] === from + width) return;
  group.at = [from, from + width];
  for (const plot of group.plots) plot.setScale("x", { min: from, max: from + width });
}
const showAll = (group) => zoom(group, ...group.full);
function scaleBy(group, factor, around) {
  const [low, high] = group.at;
  const middle = around ?? 0.5 * (low + high);
  zoom(group, middle - (middle - low) * factor, middle + (high - middle) * factor);
}
const pan = (group, part) => {
  const shift = part * (group.at[1] - group.at[0]);
  zoom(group, group.at[0] + shift, group.at[1] + shift);
};

// ---- one panel ----

const withAlpha = (colour, alpha) => colour + Math.round(255 * alpha).toString(16).padStart(2, "0");
const colourOf = (series) => series.colours[isDark() ? 1 : 0];
const ink = (series) => (series.style === "line" ? colourOf(series) : withAlpha(colourOf(series), 0.7));

// Draws it; what is given back takes other numbers of the same curves.
function draw(figure, panel, element, group, scale, tell) {
  const place = element.querySelector(".plot");
  const isCurve = panel.series.map((s) => s.style !== "dots" && !isAscending(s.x));
  // Lines come last, in front of recorded signals and dots; `slot` is where uPlot has a series.
  const order = panel.series.map((_, i) => i).sort((a, b) => depth(panel.series[a]) - depth(panel.series[b]) || a - b);
  const slot = [];
  order.forEach((i, k) => { slot[i] = k + 1; });
  const map = panel.map && cells(panel.map, scale);
  const rows = () => {
    const tables = order.map((i) => sorted(panel.series[i].x, panel.series[i].y));
    const shades = panel.envelopes.map((e) => ({ x: e.x, ys: [e.low, e.high] }));
    return joined([...tables, ...shades, ...(map ? [{ x: map.x, ys: [map.rows[0]] }] : [])]);
  };
  let data = rows();
  const n = panel.series.length;
  const extent = () => (map ? map.rows : panel.series.map((s) => s.y)).reduce((seen, one) => range(one, seen), [Infinity, -Infinity]);
  const digitsOf = ([low, high]) => decimalsOf((high > low ? high - low : Math.abs(high) || 1) * 1e-4);
  const [low, high] = extent();
  let digits = digitsOf([low, high]);
  const font = '12px "Segoe UI", Roboto, Arial, "Liberation Sans", sans-serif';
  const outputs = [...element.querySelectorAll(".key:not(.scale) output")];
  const under = element.querySelector(".key.scale output");

  const axis = (more) => ({
    stroke: () => css("--muted"), font, labelFont: font,
    grid: { show: !map, stroke: () => css("--grid"), width: 1 }, ticks: { stroke: () => css("--grid"), width: 1, size: 5 },
    values: (_, splits, __, ___, step) => splits.map((v) => (v == null ? "" : shown(v, decimalsOf(step)))), ...more,
  });
  const series = order.map((i) => [panel.series[i], i]).map(([s, i]) => ({
    label: s.name, stroke: () => ink(s), width: s.style === "line" ? 1.8 : 1, dash: s.dashes.length ? s.dashes : undefined,
    ...(s.style === "dots" || isCurve[i] ? { paths: () => null } : {}),
    points: { show: s.style === "dots", size: s.x.length > 300 ? 4 : 8, space: 0, fill: () => ink(s), stroke: () => ink(s), width: 0 },
  }));
  const edge = { stroke: "transparent", width: 0, points: { show: false }, scale: "y" };
  const fill = (e) => () =>
    e.around == null || !panel.series[e.around] ? css("--envelope") : withAlpha(colourOf(panel.series[e.around]), 0.22);
  const bands = panel.envelopes.map((e, k) => ({ series: [n + 2 + 2 * k, n + 1 + 2 * k], fill: fill(e) }));

  const shade = (plot) => {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.fillStyle = css("--band");
    for (const [from, to] of panel.bands) {
      const at = (x, end) => Math.max(bbox.left, Math.min(bbox.left + bbox.width, x == null ? end : plot.valToPos(x, "x", true)));
      const left = at(from, bbox.left), right = at(to, bbox.left + bbox.width);
      if (right > left) ctx.fillRect(left, bbox.top, Math.max(1, right - left), bbox.height);
    }
    ctx.restore();
  };
  // Curves that run back and forth, which uPlot does not draw.
  const trace = (plot) => {
    const { ctx, bbox } = plot;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    panel.series.forEach((s, i) => {
      if (!isCurve[i] || !plot.series[slot[i]].show) return;
      const { x, y } = s;
      ctx.beginPath();
      let pen = false;
      x.forEach((value, k) => {
        if (value == null || y[k] == null) { pen = false; return; }
        const point = [plot.valToPos(value, "x", true), plot.valToPos(y[k], "y", true)];
        if (pen) ctx.lineTo(...point); else ctx.moveTo(...point);
        pen = true;
      });
      ctx.strokeStyle = ink(s);
      ctx.setLineDash(s.dashes.map((length) => length * uPlot.pxRatio));
      ctx.lineWidth = (s.style === "line" ? 1.8 : 1) * uPlot.pxRatio;
      ctx.stroke();
    });
    ctx.restore();
  };
  const at = (k) => `${panel.title.split(" [")[0]} ${map.places[map.row]}: ${shown(map.rows[map.row][k], digits)}${panel.unit && " " + panel.unit}`;
  const read = (plot) => {
    if (map) {
      const { idx, left, top } = plot.cursor;
      if (top >= 0) map.row = nearest(map.places, plot.posToVal(top, "y"));
      under.textContent = idx == null || left < 0 ? "" : at(idx);
    }
    outputs.forEach((output, i) => {
      const k = plot.cursor.idxs[slot[i]];
      output.textContent = k == null ? "" : `${shown(data[slot[i]][k], digits)}${panel.unit && " " + panel.unit}`;
    });
    const k = plot.cursor.idx;
    tell(k == null || plot.cursor.left < 0 ? null : data[0][k]);
  };
  const relink = (plot, key) => {
    const { min, max } = plot.scales.x;
    if (key === "x" && (min !== group.at[0] || max !== group.at[1])) zoom(group, min, max);
  };

  const [from, to] = group.at;
  const plot = new uPlot({
    width: place.clientWidth, height: place.clientHeight,
    scales: { x: { time: false, auto: false, min: from, max: to }, y: { range: (_, l, h) => (map ? map.edges : roomy(l, h)) } },
    legend: { show: false },
    cursor: {
      drag: { x: true, y: false },
      sync: { key: figure.link, scales: ["x", null], filters: { pub: (type) => !type.startsWith("mouse") || type === "mousemove" || type === "mouseleave" } },
      bind: { dblclick: () => () => { showAll(group); return null; } },
      points: { size: 7 },
    },
    axes: [
      axis({ label: figure.x, labelSize: 20, size: 30 }),
      axis({ size: (_, values) => 16 + 7 * Math.max(3, ...(values ?? []).map((v) => v.length)) }),
    ],
    series: [{}, ...series, ...panel.envelopes.flatMap(() => [edge, edge]), ...(map ? [edge] : [])],
    bands,
    hooks: { drawClear: [shade, ...(map ? [map.paint] : [])], draw: [trace], setCursor: [read], setScale: [relink] },
  }, data, place);
  group.plots.add(plot);
  place.querySelector("canvas").setAttribute("aria-hidden", "true");
  const resized = new ResizeObserver(() => {
    if (place.clientWidth) plot.setSize({ width: place.clientWidth, height: place.clientHeight });
  });
  resized.observe(place);
  keyboard(place, plot, group, () => data, map, (k) => {
    if (map) { say(`${figure.x} ${shown(data[0][k], 6)}: ${at(k)}`); return; }
    const values = panel.series.map((s, i) => `${s.name} ${shown(data[slot[i]][k], digits)} ${panel.unit}`);
    say(`${figure.x} ${shown(data[0][k], 6)}: ${values.join(", ")}`);
  });
  keys(element, plot, panel, slot);
  const handle = {
    update(next) {
      panel = next;
      [data, digits] = [rows(), digitsOf(extent())];
      plot.setData(data);
    },
    remove() {
      resized.disconnect();
      group.plots.delete(plot);
      plot.destroy();
    },
  };
  if (!map) return handle;
  const swatch = element.querySelector(".key.scale i");
  swatch.style.background = `linear-gradient(to right, ${scale.join(", ")})`;
  // What rounding leaves of nothing is nothing.
  const end = (value) => shown(Math.abs(value) < 1e-9 * (high - low) ? 0 : value, digits);
  swatch.nextElementSibling.textContent = `${end(low)} … ${end(high)} ${panel.unit}`;
  return handle;
}

const nearest = (sorted, value) => {
  let low = 0, high = sorted.length - 1;
  while (low < high) { const middle = (low + high) >> 1; if (sorted[middle] < value) low = middle + 1; else high = middle; }
  return low > 0 && value - sorted[low - 1] <= sorted[low] - value ? low - 1 : low;
};

// A heat map: which row the cursor is on, and what paints the cells, a pixel of the screen for each column.
function cells({ x, places, rows, low, high }, scale) {
  const map = { x, places, rows };
  const n = map.places.length, half = n > 1 ? 0.5 * (map.places[1] - map.places[0]) : 0.5;
  map.row = n >> 1;
  map.edges = [map.places[0] - half, map.places[n - 1] + half];
  const levels = scale.map((hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16)));
  const level = (value) => levels[Math.max(0, Math.min(levels.length - 1, Math.floor(((value - low) / (high - low || 1)) * levels.length)))];
  const canvas = make("canvas");
  map.paint = (plot) => {
    const { ctx, bbox } = plot;
    const width = (canvas.width = Math.max(1, Math.round(bbox.width)));
    canvas.height = n;
    const brush = canvas.getContext("2d"), image = brush.createImageData(width, n);
    for (let column = 0; column < width; column++) {
      const k = nearest(map.x, plot.posToVal(bbox.left + column + 0.5, "x", true));
      map.rows.forEach((row, i) => {
        if (row[k] != null) image.data.set([...level(row[k]), 255], 4 * ((n - 1 - i) * width + column));
      });
    }
    brush.putImageData(image, 0, 0);
    ctx.save();
    ctx.imageSmoothingEnabled = false;
    ctx.drawImage(canvas, bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.restore();
  };
  return map;
}

const depth = (series) => ["dots", "thin", "line"].indexOf(series.style);

function roomy(low, high) {
  if (low == null || high == null) return [0, 1];
  const room = 0.06 * (high - low || Math.abs(high) || 1);
  return [low - room, high + room];
}

// ---- what a reader does ----

const status = make("div", { className: "unseen" });
status.setAttribute("role", "status");
const say = (words) => { status.textContent = words; };

function keyboard(place, plot, group, rows, map, tell) {
  place.tabIndex = 0;
  place.setAttribute("role", "application");
  place.setAttribute("aria-label", `${place.parentElement.getAttribute("aria-label")} Arrow keys move the cursor, plus and minus zoom, 0 shows all.`);
  const move = (steps) => {
    const [x] = rows();
    let k = plot.cursor.idx ?? x.findIndex((value) => value >= group.at[0]);
    k = Math.max(0, Math.min(x.length - 1, k + steps));
    if (x[k] < group.at[0] || x[k] > group.at[1]) {
      const half = 0.5 * (group.at[1] - group.at[0]);
      zoom(group, x[k] - half, x[k] + half);
    }
    // uPlot scales when its microtask comes.
    const top = () => (map ? plot.valToPos(map.places[map.row], "y") : plot.bbox.height / 2 / uPlot.pxRatio);
    setTimeout(() => { plot.setCursor({ left: plot.valToPos(x[k], "x"), top: top() }, true, true); tell(k); });
  };
  const climb = (steps) => { map.row = Math.max(0, Math.min(map.places.length - 1, map.row + steps)); move(0); };
  const under = () => (plot.cursor.idx == null ? null : rows()[0][plot.cursor.idx]);
  place.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const step = event.shiftKey ? Math.max(10, Math.round(rows()[0].length / 50)) : 1;
    const action = {
      ArrowLeft: () => move(-step), ArrowRight: () => move(step),
      ...(map ? { ArrowUp: () => climb(1), ArrowDown: () => climb(-1) } : {}),
      "+": () => scaleBy(group, 0.5, under()), "=": () => scaleBy(group, 0.5, under()),
      "-": () => scaleBy(group, 2, under()), 0: () => showAll(group), Escape: () => showAll(group),
      PageUp: () => pan(group, -0.5), PageDown: () => pan(group, 0.5),
      Home: () => pan(group, -1e9), End: () => pan(group, 1e9),
    }[event.key];
    if (action) { event.preventDefault(); action(); }
  });
  place.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return;
    event.preventDefault();
    scaleBy(group, event.deltaY > 0 ? 1.25 : 0.8, under());
  }, { passive: false });
}

// Names switch their curves on and off.
function keys(element, plot, panel, slot) {
  [...element.querySelectorAll(".key:not(.area, .scale)")].forEach((key, i) => {
    const series = panel.series[i], swatch = key.querySelector("i"), output = key.querySelector("output");
    swatch.className = series.style;
    const paint = () => { swatch.style.background = ink(series); };
    paint();
    repaints.add({ swatch, paint });
    if (!series.name) return;
    const button = make("button", { type: "button" });
    button.append(...[...key.childNodes].filter((node) => node !== output));
    button.setAttribute("aria-pressed", "true");
    button.addEventListener("click", () => {
      const show = !plot.series[slot[i]].show;
      plot.setSeries(slot[i], { show });
      button.setAttribute("aria-pressed", String(show));
    });
    key.prepend(button);
  });
  panel.envelopes.forEach((envelope, i) => {
    const swatch = element.querySelectorAll(".key.area i")[i];
    if (!swatch || envelope.around == null) return;
    const paint = () => { swatch.style.background = withAlpha(colourOf(panel.series[envelope.around]), 0.3); };
    paint();
    repaints.add({ swatch, paint });
  });
}

function tools(group, name) {
  const bar = make("div", { className: "tools" });
  bar.setAttribute("role", "toolbar");
  bar.setAttribute("aria-label", `Zoom of ${name}`);
  const buttons = [
    ["+", "Zoom in", () => scaleBy(group, 0.5)], ["−", "Zoom out", () => scaleBy(group, 2)],
    ["◀", "Earlier", () => pan(group, -0.5)], ["▶", "Later", () => pan(group, 0.5)], ["all", "Show all", () => showAll(group)],
  ];
  for (const [text, title, action] of buttons) {
    const button = make("button", { type: "button", textContent: text, title });
    button.setAttribute("aria-label", title);
    button.addEventListener("click", action);
    bar.append(button);
  }
  const readout = make("output");
  bar.append(readout);
  return [bar, readout];
}

// The number in a cell, as its table gives it or as it is written: `(1.2 ± 0.1)·10⁸`.
function valueOf(cell) {
  if (cell.dataset.sort != null) return Number(cell.dataset.sort);
  if (!cell.classList.contains("number")) return null;
  const text = cell.textContent.trim().replaceAll("−", "-");
  const found = text.match(/^\(?(-?[\d.]+)(?: ± [\d.]+\)?)?(?:·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))?/);
  if (!found) return null;
  const power = (found[2] ?? "").replace(/./g, (c) => (c === "⁻" ? "-" : "⁰¹²³⁴⁵⁶⁷⁸⁹".indexOf(c)));
  return Number(found[1]) * 10 ** Number(power);
}

function sortable(table) {
  const heads = [...table.querySelectorAll("thead tr:last-child > *")];
  const body = table.tBodies[0];
  heads.forEach((head, j) => {
    if (head.tagName !== "TH" || head.colSpan > 1 || body.rows.length < 2) return;
    const button = make("button", { type: "button", title: "Sort" });
    button.append(...head.childNodes);
    head.append(button);
    const by = (row) => valueOf(row.cells[j]) ?? row.cells[j].textContent.trim();
    const isNumeric = [...body.rows].some((row) => valueOf(row.cells[j]) != null);
    const compare = (a, b) => {
      const [x, y] = [by(a), by(b)];
      if (!isNumeric) return x.localeCompare(y, "en", { numeric: true });
      const missing = (typeof x !== "number") - (typeof y !== "number");
      return missing ? missing * Infinity : x - y;
    };
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const order = (a, b) => { const c = compare(a, b); return Math.abs(c) === Infinity ? c : up ? c : -c; };
      body.append(...[...body.rows].sort(order));
    });
  });
}

// ---- light and dark ----

const repaints = new Set();
function repaint() {
  for (const one of repaints) {
    if (one.swatch.isConnected) one.paint(); else repaints.delete(one);
  }
  for (const { plots } of groups.values()) for (const plot of plots) plot.redraw(false, true);
}
function themes() {
  const names = ["auto", "light", "dark"];
  let chosen = 0;
  const button = make("button", { type: "button", className: "theme" });
  const show = () => {
    button.textContent = `Colours: ${names[chosen]}`;
    if (chosen) root.dataset.theme = names[chosen]; else delete root.dataset.theme;
    repaint();
  };
  button.addEventListener("click", () => { chosen = (chosen + 1) % 3; show(); });
  show();
  darkness.addEventListener("change", repaint);
  return button;
}

// ---- figures ----

// Figures with their columns in place of the columns' numbers.
function filled({ columns, figures }) {
  const at = (k) => columns[k];
  const series = (one) => ({ ...one, x: at(one.x), y: at(one.y) });
  const envelope = (one) => ({ ...one, x: at(one.x), low: at(one.low), high: at(one.high) });
  const map = (one) => one && { ...one, x: at(one.x), places: at(one.places), rows: one.rows.map(at) };
  const panel = (one) => ({ ...one, series: one.series.map(series), envelopes: one.envelopes.map(envelope), map: map(one.map) });
  return figures.map((figure) => ({ ...figure, panels: figure.panels.map(panel) }));
}

// What two lots of figures have in common where one can take the other's numbers.
const shape = (figures) => JSON.stringify(figures.map(({ link, x, panels }) => [link, x, panels.map((panel) => [
  panel.title, panel.unit, panel.series.map((one) => [one.name, one.style, one.colours, one.dashes]),
  panel.envelopes.map((one) => one.around), panel.map && Math.random(),
])]));

// Puts the charts of some figures into the elements that wait for them.
function mount(root, given) {
  let figures = filled(given);
  const own = {};
  const place = () => {
    const spans = new Map();
    for (const figure of figures) {
      const span = spans.get(figure.link) ?? { low: Infinity, high: -Infinity, hasDots: false };
      for (const panel of figure.panels) {
        for (const one of [...panel.series, ...panel.envelopes, ...(panel.map ? [panel.map] : [])]) {
          [span.low, span.high] = range(one.x, [span.low, span.high]);
        }
        span.hasDots ||= panel.series.some((one) => one.style === "dots");
      }
      spans.set(figure.link, span);
    }
    for (const [link, span] of spans) {
      groupOf(link).spans.set(own, span);
      settle(groupOf(link));
    }
  };
  place();
  // Panels are drawn when they come into sight, and take new numbers then.
  const panels = new Map();
  const show = (one) => {
    const panel = figures[one.figure].panels[one.index];
    if (!one.chart) one.chart = draw(figures[one.figure], panel, one.element, one.group, given.scale, one.tell);
    else if (one.panel !== panel) one.chart.update(panel);
    one.panel = panel;
  };
  const nearby = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      const one = panels.get(target);
      one.isNear = isIntersecting;
      if (isIntersecting) show(one);
    }
    // What is in sight answers.
    if (!performance.getEntriesByName("interactive").length) requestAnimationFrame(() => performance.mark("interactive"));
  }, { rootMargin: "400px" });
  root.querySelectorAll("figure.chart").forEach((element) => {
    const number = Number(element.dataset.figure), figure = figures[number];
    const group = groupOf(figure.link);
    const name = element.closest("section")?.querySelector("h2")?.textContent ?? figure.x;
    const [bar, readout] = tools(group, name);
    const all = element.querySelector(".panels");
    all.hidden = false;
    all.before(bar);
    const tell = (x) => { readout.textContent = x == null ? "" : `${figure.x}: ${shown(x, decimalsOf((group.full[1] - group.full[0]) * 1e-5))}`; };
    [...all.children].forEach((child, index) => {
      panels.set(child, { figure: number, index, element: child, group, tell, isNear: false });
      nearby.observe(child);
    });
  });
  return {
    // Whether these figures were taken: they are if they have the same curves.
    update(next) {
      const others = filled(next);
      if (shape(others) !== shape(figures)) return false;
      figures = others;
      place();
      for (const one of panels.values()) if (one.isNear && one.chart) show(one);
      return true;
    },
    remove() {
      nearby.disconnect();
      for (const one of panels.values()) one.chart?.remove();
      for (const group of groups.values()) group.spans.delete(own);
    },
  };
}

// ---- a page ----

function start() {
  root.classList.add("live");
  const main = document.querySelector("main");
  main.prepend(themes());
  main.append(status);
}
const sortTables = (within) => within.querySelectorAll("table.sortable").forEach(sortable);

function report() {
  start();
  sortTables(document);
  mount(document, JSON.parse(document.getElementById("data").textContent));
}
return { start, mount, sortTables, report, say };
})();
