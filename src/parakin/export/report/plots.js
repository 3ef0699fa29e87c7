// Draws the report's figures on canvases: curves and stacked bars in panels over a shared x axis, with the values under
// the pointer or the arrow keys, and a closer view of what is dragged over. The figures are in plotly's JSON, as far as
// panels.py writes it; each is {data: traces, layout}.
"use strict";

const INK = "#263238", SOFT = "#546e7a", GRID = "#e3e8ec";
const NEAR = 40;  // px from the pointer: a point farther away is not meant
const DRAGGED = 6;  // px: less is no span

function formatNumber(value, format) {
  if (format === ".0%" || format === ".1%") return `${(100 * value).toFixed(Number(format[1]))}%`;
  if (format === "~s") {
    const [power, letter] = [[9, "G"], [6, "M"], [3, "k"]].find(([p]) => Math.abs(value) >= 10 ** p) ?? [0, ""];
    return `${Number((value / 10 ** power).toPrecision(6))}${letter}`.replace("-", "−");
  }
  const digits = /\.(\d+)f/.exec(format);
  const options = digits ? { minimumFractionDigits: +digits[1], maximumFractionDigits: +digits[1] } : { maximumFractionDigits: 9 };
  return value.toLocaleString("en-US", options).replace("-", "−");
}

function drawLine(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}

function listTicks(low, high, count) {
  const rough = (high - low) / Math.max(1, count), unit = 10 ** Math.floor(Math.log10(rough));
  const step = unit * ([1, 2, 5].find((factor) => factor * unit >= rough) ?? 10);
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(Number((k * step).toPrecision(12)));
  return ticks;
}

// Fills a text such as "%{x:,.3f} s, line %{customdata[1]}<extra>name</extra>" with a point's values.
function describePoint(trace, at) {
  const custom = trace.customdata?.[at];
  const text = trace.hovertemplate.replace(/%\{([^}:]+)(?::([^}]*))?\}/g, (_, name, format) => {
    const index = /^customdata\[(\d+)\]$/.exec(name);
    const value = index ? custom[index[1]] : { x: trace.x[at], y: trace.y[at], customdata: custom, "fullData.name": trace.name }[name];
    return format ? formatNumber(value, format) : value;
  });
  return text.replace(/<extra>(.*?)<\/extra>/, (_, name) => name && `<br><b>${name}</b>`);
}

class Plot {
  constructor(place, figure) {
    this.place = place;
    this.layout = figure.layout;
    this.panels = this.listPanels(figure);
    this.full = this.findSpan();
    this.span = this.full;
    this.chosen = null;
    this.canvas = place.appendChild(document.createElement("canvas"));
    this.note = place.appendChild(document.createElement("div"));
    this.note.className = "note";
    place.tabIndex = 0;
    place.setAttribute("role", "application");
    place.setAttribute("aria-label", `${this.panels.map((panel) => panel.title.textContent).join("; ")}. Arrow keys read the values.`);
    this.note.setAttribute("aria-live", "polite");
    for (const kind of ["pointermove", "pointerdown", "pointerup", "pointerleave", "dblclick", "keydown", "blur"])
      place.addEventListener(kind, (event) => this[kind](event));
    new ResizeObserver(() => this.draw()).observe(place);
    addEventListener("hashchange", () => this.draw());
  }

  listPanels({ data, layout }) {
    const named = Object.keys(layout).filter((key) => key.startsWith("yaxis")).map((key) => `y${key.slice(5)}`);
    return named.map((y, number) => {
      const traces = data.filter((trace) => (trace.yaxis ?? "y") === y);
      const axis = layout[`yaxis${y.slice(1)}`];
      const x = axis.anchor ?? "x", across = layout[`xaxis${x.slice(1)}`];
      const title = this.place.appendChild(document.createElement("div"));
      title.className = "title";
      title.innerHTML = layout.annotations[number].text;
      title.title = title.textContent;
      const bounds = layout.shapes.filter((shape) => shape.yref === y);
      return { traces, axis, across, title, bounds, named: across.anchor === y };
    });
  }

  findSpan() {
    const given = this.layout.xaxis.range;
    if (given) return given;
    let low = Infinity, high = -Infinity;
    for (const panel of this.panels) for (const trace of panel.traces) for (const x of trace.x) {
      low = Math.min(low, x);
      high = Math.max(high, x);
    }
    return low < high ? [low, high] : [low - 0.5, low + 0.5];
  }

  // The rectangle of a panel, px.
  frame(panel) {
    const { l, r, t, b } = this.layout.margin;
    const width = this.place.clientWidth - l - r, height = this.layout.height - t - b;
    const [left, right] = panel.across.domain ?? [0, 1], [low, high] = panel.axis.domain;
    return { x: l + left * width, y: t + (1 - high) * height, width: (right - left) * width, height: (high - low) * height };
  }

  scales(panel) {
    const frame = this.frame(panel), [x0, x1] = this.span, [y0, y1] = panel.axis.range;
    return {
      frame,
      x: (value) => frame.x + ((value - x0) / (x1 - x0)) * frame.width,
      y: (value) => frame.y + (1 - (value - y0) / (y1 - y0)) * frame.height,
    };
  }

  draw() {
    const width = this.place.clientWidth, height = this.layout.height, dots = devicePixelRatio;
    if (!width) return;
    Object.assign(this.canvas, { width: width * dots, height: height * dots });
    Object.assign(this.canvas.style, { width: `${width}px`, height: `${height}px` });
    const pen = this.canvas.getContext("2d");
    pen.scale(dots, dots);
    pen.font = `12px ${this.layout.font.family}`;
    for (const panel of this.panels) this.drawPanel(pen, panel);
    if (this.chosen) this.drawChosen(pen);
    if (this.from !== undefined && this.to !== undefined) this.drawDragged(pen);
  }

  drawPanel(pen, panel) {
    const { frame, x, y } = this.scales(panel), [y0, y1] = panel.axis.range;
    Object.assign(panel.title.style, { left: `${frame.x}px`, top: `${frame.y - 22}px`, maxWidth: `${frame.width}px` });
    pen.lineWidth = 1;
    pen.strokeStyle = GRID;
    pen.fillStyle = SOFT;
    pen.textBaseline = "middle";
    pen.textAlign = "right";
    for (const tick of listTicks(y0, y1, 4)) {
      drawLine(pen, frame.x, Math.round(y(tick)) + 0.5, frame.x + frame.width, Math.round(y(tick)) + 0.5);
      pen.fillText(formatNumber(tick, panel.axis.tickformat), frame.x - 6, y(tick));
    }
    pen.textBaseline = "top";
    pen.textAlign = "center";
    for (const tick of listTicks(...this.span, Math.max(2, frame.width / 110))) {
      drawLine(pen, Math.round(x(tick)) + 0.5, frame.y, Math.round(x(tick)) + 0.5, frame.y + frame.height);
      if (panel.named) pen.fillText(formatNumber(tick, ","), x(tick), frame.y + frame.height + 6);
    }
    if (panel.named) pen.fillText(panel.across.title.text, frame.x + frame.width / 2, frame.y + frame.height + 24);
    pen.save();
    pen.beginPath();
    pen.rect(frame.x, frame.y - 1, frame.width, frame.height + 2);
    pen.clip();
    const piled = new Map();
    for (const trace of panel.traces) (trace.type === "bar" ? this.drawBars : this.drawCurve).call(this, pen, trace, x, y, piled);
    for (const { y0: bound, line } of panel.bounds) {
      this.setLine(pen, line);
      drawLine(pen, frame.x, y(bound), frame.x + frame.width, y(bound));
    }
    pen.restore();
    pen.setLineDash([]);
    pen.strokeStyle = "#cfd8dc";
    drawLine(pen, frame.x + 0.5, frame.y, frame.x + 0.5, frame.y + frame.height);
  }

  setLine(pen, { color, width, dash }) {
    pen.strokeStyle = color;
    pen.lineWidth = width;
    pen.setLineDash({ dash: [6, 4], dot: [2, 3] }[dash] ?? []);
  }

  drawBars(pen, trace, x, y, piled) {
    pen.fillStyle = trace.marker.color;
    trace.x.forEach((at, number) => {
      const under = piled.get(at) ?? 0, top = under + trace.y[number];
      const left = x(at - trace.width / 2), right = x(at + trace.width / 2);
      pen.fillRect(left, y(top), Math.max(right - left, 0.5) + 0.3, y(under) - y(top));
      piled.set(at, top);
    });
  }

  drawCurve(pen, trace, x, y) {
    if (trace.mode.includes("lines")) this.drawLines(pen, trace, x, y);
    if (trace.mode.includes("markers")) this.drawMarkers(pen, trace, x, y);
  }

  drawLines(pen, trace, x, y) {
    this.setLine(pen, trace.line);
    pen.lineJoin = "round";
    pen.beginPath();
    let before = null;
    trace.y.forEach((value, number) => {
      if (value !== null) {
        if (before === null) pen.moveTo(x(trace.x[number]), y(value));
        else {
          if (trace.line.shape === "hv") pen.lineTo(x(trace.x[number]), y(before));
          pen.lineTo(x(trace.x[number]), y(value));
        }
      }
      before = value;
    });
    pen.stroke();
  }

  // Draws points, with their texts; a ring is about the one whose link is where the document is.
  drawMarkers(pen, trace, x, y) {
    pen.fillStyle = trace.marker.color ?? trace.line.color;
    trace.y.forEach((value, number) => {
      if (value !== null) this.drawDot(pen, x(trace.x[number]), y(value), trace.marker.size / 2);
    });
    pen.setLineDash([]);
    pen.strokeStyle = pen.fillStyle = INK;
    pen.textAlign = "left";
    pen.textBaseline = "bottom";
    trace.y.forEach((value, number) => {
      if (value === null) return;
      const [px, py] = [x(trace.x[number]), y(value)];
      if (trace.text) pen.fillText(trace.text[number], px + 6, py - 4);
      if (trace.links?.[number] !== location.hash) return;
      pen.lineWidth = 2;
      pen.beginPath();
      pen.arc(px, py, trace.marker.size / 2 + 4, 0, 2 * Math.PI);
      pen.stroke();
    });
  }

  drawDot(pen, x, y, radius) {
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fill();
  }

  drawChosen(pen) {
    const { panel, trace, at } = this.chosen;
    pen.setLineDash([]);
    pen.lineWidth = 1;
    pen.strokeStyle = SOFT;
    for (const one of this.panels) {
      const { frame, x } = this.scales(one);
      drawLine(pen, x(trace.x[at]), frame.y, x(trace.x[at]), frame.y + frame.height);
    }
    const { x, y } = this.scales(panel);
    pen.fillStyle = INK;
    if (trace.type !== "bar") this.drawDot(pen, x(trace.x[at]), y(trace.y[at]), 4);
  }

  drawDragged(pen) {
    const { frame } = this.scales(this.dragged);
    pen.fillStyle = "rgba(47, 111, 179, .15)";
    pen.fillRect(Math.min(this.from, this.to), frame.y, Math.abs(this.to - this.from), frame.height);
  }

  panelAt(x, y) {
    return this.panels.find((panel) => {
      const frame = this.frame(panel);
      return x >= frame.x && x <= frame.x + frame.width && y >= frame.y && y <= frame.y + frame.height;
    });
  }

  // The point of a panel nearest to a place; of bars that under it.
  nearest(panel, px, py) {
    const { x, y } = this.scales(panel);
    let best = null, least = NEAR;
    const piled = new Map();
    for (const trace of panel.traces) {
      if (!trace.hovertemplate) continue;
      trace.x.forEach((value, at) => {
        if (trace.y[at] === null) return;
        let away;
        if (trace.type === "bar") {
          const under = piled.get(value) ?? 0, top = under + trace.y[at];
          piled.set(value, top);
          const within = Math.abs(x(value) - px) <= (x(trace.width) - x(0)) / 2 + 0.5 && py <= y(under) && py >= y(top);
          away = within ? 0 : Infinity;
        } else away = Math.hypot(x(value) - px, y(trace.y[at]) - py);
        if (away < least) [best, least] = [{ panel, trace, at }, away];
      });
    }
    return best;
  }

  choose(point) {
    this.chosen = point;
    this.note.hidden = !point;
    this.place.style.cursor = point?.trace.links ? "pointer" : "";
    if (point) {
      const { panel, trace, at } = point, { frame, x } = this.scales(panel);
      this.note.innerHTML = describePoint(trace, at);
      const width = this.note.offsetWidth, place = this.place.clientWidth;
      const left = x(trace.x[at]) + 12;
      Object.assign(this.note.style, { left: `${left + width > place ? left - width - 24 : left}px`, top: `${frame.y + 6}px` });
    }
    this.draw();
  }

  pointermove(event) {
    if (this.from !== undefined) {
      this.to = event.clientX - this.place.getBoundingClientRect().left;
      this.draw();
      return;
    }
    this.choose(this.pointUnder(event));
  }

  pointUnder(event) {
    const { left, top } = this.place.getBoundingClientRect(), x = event.clientX - left, y = event.clientY - top;
    const panel = this.panelAt(x, y);
    return panel ? this.nearest(panel, x, y) : null;
  }

  // Goes to where a point links to, if it does.
  follow(point) {
    const link = point?.trace.links?.[point.at];
    if (link) location.hash = link;
  }

  pointerdown(event) {
    const { left, top } = this.place.getBoundingClientRect(), x = event.clientX - left;
    this.dragged = this.panelAt(x, event.clientY - top);
    if (this.dragged && event.button === 0 && event.pointerType === "mouse") {
      this.from = x;
      this.place.setPointerCapture(event.pointerId);
    }
  }

  pointerup(event) {
    const { from, to } = this;
    this.from = this.to = undefined;
    if (from === undefined || to === undefined || Math.abs(to - from) < DRAGGED) return this.follow(this.pointUnder(event));
    const frame = this.frame(this.dragged), [x0, x1] = this.span;
    const ends = [Math.min(from, to), Math.max(from, to)].map((px) => x0 + (Math.min(1, Math.max(0, (px - frame.x) / frame.width))) * (x1 - x0));
    if (ends[1] - ends[0] > 1e-9 * (this.full[1] - this.full[0])) this.span = ends;
    this.choose(null);
  }

  pointerleave() {
    if (this.from === undefined) this.choose(null);
  }

  blur() {
    this.choose(null);
  }

  dblclick() {
    this.span = this.full;
    this.choose(null);
  }

  keydown(event) {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key], change = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (event.key === "Escape") this.dblclick();
    else if (event.key === "Enter") this.follow(this.chosen);
    else if (step) this.step(step);
    else if (change) this.change(change);
    else return;
    event.preventDefault();
  }

  // Reads the next point of the curve that is read, or the first one.
  step(step) {
    if (!this.chosen) return this.change(0);
    const { trace } = this.chosen;
    let at = this.chosen.at + step;
    while (trace.y[at] === null) at += step;
    if (at >= 0 && at < trace.x.length) this.choose({ ...this.chosen, at });
  }

  // Reads the next panel, at the same place.
  change(step) {
    const before = this.chosen ? this.panels.indexOf(this.chosen.panel) : 0, count = this.panels.length;
    const x = this.chosen ? this.chosen.trace.x[this.chosen.at] : this.span[0];
    for (let away = 0; away < count; away++) {
      const panel = this.panels[(before + (step || 1) * away + step + count * count) % count];
      const trace = panel.traces.find((one) => one.hovertemplate && one.y.some((value) => value !== null));
      if (!trace) continue;
      let best = -1;
      trace.x.forEach((value, at) => {
        if (trace.y[at] !== null && (best < 0 || Math.abs(value - x) < Math.abs(trace.x[best] - x))) best = at;
      });
      return this.choose({ panel, trace, at: best });
    }
  }
}

for (const source of document.querySelectorAll("script[data-figure]"))
  new Plot(document.getElementById(source.dataset.figure), JSON.parse(source.textContent));
