// Draws a figure of Plotly as an SVG, in a fraction of Plotly's processor time: lines, areas and dots on axes with
// ranges, and the values at the pointer.
const ARRAYS = { f8: Float64Array, f4: Float32Array, i4: Int32Array, i2: Int16Array, i1: Int8Array,
  u4: Uint32Array, u2: Uint16Array, u1: Uint8Array };
const DASHES = { dot: '3 3', dash: '9 9', dashdot: '9 3 3 3' };
const EDGE = { left: 8, right: 12, top: 8, bottom: 8 }; // margins in pixels
const LETTER = 12, TITLE = 18, TICK = 4, GAP = 3; // height of letters, room for a title, ticks and their distance
const APART = 16; // minimum distance between two numbers of an axis in pixels
const NEAR = 20; // maximum distance in pixels between the pointer and a dot with shown values
const pen = new OffscreenCanvas(1, 1).getContext('2d');

export default drawnBy(class {
  constructor(root) {
    this.root = root;
    [this.svg, this.spike, this.readout] = root.children;
    const sizes = new ResizeObserver(([{ contentRect: { width, height } }]) => {
      Object.assign(this, { width, height });
      this.draw();
    });
    const deaf = hear(root, { pointermove: (event) => this.read(event), pointerleave: () => this.hide() });
    sizes.observe(root);
    this.stop = () => { sizes.disconnect(); deaf(); drawers.delete(root); };
  }

  show({ figure, alt }) {
    this.svg.setAttribute('aria-label', alt);
    if (figure === this.sent) return;
    this.sent = figure;
    const { data, layout } = JSON.parse(figure);
    for (const axis of [layout.xaxis, layout.yaxis]) axis.title.text = plain(axis.title.text);
    for (const trace of data) Object.assign(trace, { name: plain(trace.name), x: values(trace.x), y: values(trace.y) });
    this.root.figure = { layout, data }; // for the menu that saves the chart
    this.draw();
  }

  draw() {
    const { width, height, root: { figure } } = this;
    this.hide();
    if (!figure || !width || !height) return;
    const { xaxis, yaxis, font } = figure.layout, { top, right, bottom } = EDGE;
    pen.font = `${LETTER}px ${font.family}`;
    const high = Math.max(height - top - TICK - GAP - LETTER - (xaxis.title.text ? TITLE : 0) - bottom, 1);
    const rows = marksOf(yaxis, high / APART).map(({ at, text }) => ({ at, text: cut(text, width * 0.45) }));
    const left = EDGE.left + (yaxis.title.text ? TITLE : 0) + Math.max(...rows.map(({ text }) => long(text))) + TICK + GAP;
    const wide = Math.max(width - left - right, 1);
    const columns = marksOf(xaxis, wide / (APART + long(xaxis.range[1].toFixed())));
    this.box = { left, top, wide, high, x: scale(xaxis.range, 0, wide), y: scale(yaxis.range, high, 0) };
    const look = { width, height, 'font-family': font.family, 'font-size': LETTER };
    for (const [name, value] of Object.entries(look)) this.svg.setAttribute(name, value);
    this.svg.replaceChildren(...this.traces(figure.data), this.axis('x', xaxis, columns), this.axis('y', yaxis, rows));
  }

  traces(data) {
    const { left, top, wide, high } = this.box;
    const clipped = shape('svg', { x: left, y: top, width: wide, height: high, style: 'overflow: hidden' });
    const above = shape('g', { transform: `translate(${left} ${top})` });
    for (const trace of data) {
      const place = trace.cliponaxis === false ? above : clipped;
      if (trace.mode.includes('lines')) place.append(lineOf(trace, this.box));
      if (trace.mode.includes('markers')) place.append(dotsOf(trace, this.box));
    }
    return [clipped, above];
  }

  // Return the line, ticks, numbers and title of an axis.
  axis(name, { title, showline, ticks: outside, linecolor, tickfont }, marks) {
    const { left, top, wide, high, [name]: scaled } = this.box, isX = name === 'x', base = top + high;
    const tick = outside ? TICK : 0, end = left + wide + EDGE.right;
    const d = showline === false ? [] : [`M${left} ${base}${isX ? `h${wide}` : `v${-high}`}`];
    const texts = marks.map(({ at, text }) => {
      const place = (isX ? left : top) + scaled(at);
      d.push(isX ? `M${place} ${base}v${tick}` : `M${left} ${place}h${-tick}`);
      return shape('g', { class: `${name}tick` }, isX
        ? words(text, Math.min(place, end - long(text) / 2), base + tick + GAP + LETTER - 2)
        : words(text, left - tick - GAP, place + LETTER / 3, { 'text-anchor': 'end' }));
    });
    const text = cut(title.text, isX ? end : this.height), half = long(text) / 2;
    const x = isX ? Math.min(left + wide / 2, end - half) : EDGE.left + LETTER - 2;
    const y = isX ? this.height - EDGE.bottom : Math.max(top + high / 2, half);
    texts.push(words(text, x, y, { class: `${name}title`, transform: isX ? '' : `rotate(-90 ${x} ${y})` }));
    return shape('g', { fill: tickfont.color }, shape('path', { d: d.join(''), stroke: linecolor }), ...texts);
  }

  // Show the values at the pointer: of all lines, or of the nearest dot.
  read({ clientX, clientY }) {
    if (!this.box) return;
    const { left, top, wide, high, x, y } = this.box, { layout, data } = this.root.figure;
    const corner = this.root.getBoundingClientRect(), unified = layout.hovermode === 'x unified';
    const across = clientX - corner.left - left, down = clientY - corner.top - top;
    const nearest = data.filter((trace) => trace.hovertemplate && trace.x.length).map((trace) => {
      const distance = (k) => Math.hypot(x(trace.x[k]) - across, unified ? 0 : y(trace.y[k]) - down);
      const k = Array.from(trace.x.keys()).reduce((best, each) => (distance(each) < distance(best) ? each : best));
      return { trace, k, at: trace.x[k], distance: distance(k) };
    });
    const first = nearest.reduce((best, each) => (each.distance < best.distance ? each : best), { distance: Infinity });
    const inside = across === clamp(across, 0, wide) && down === clamp(down, 0, high);
    if (!inside || first.distance > (unified ? wide : NEAR)) return this.hide();
    const shown = unified ? nearest.filter(({ at }) => at === first.at) : [first];
    const lines = shown.map(({ trace, k }) => {
      const text = filled(trace, k), stroke = element('i');
      stroke.style.borderTop = `2px ${trace.line?.dash ? 'dotted' : 'solid'} ${trace.line?.color}`;
      return element('div', {}, ...(unified ? [stroke, `${trace.name}: ${text}`] : [text]));
    });
    const place = left + x(first.at), { bgcolor: background, bordercolor: borderColor } = layout.hoverlabel;
    const [side, other] = x(first.at) < wide / 2 ? ['left', 'right'] : ['right', 'left'];
    this.readout.replaceChildren(...(unified ? [String(first.at)] : []), ...lines);
    Object.assign(this.readout.style, { background, borderColor, color: layout.font.color, [other]: '',
      [side]: `${(side === 'left' ? place : corner.width - place) + 9}px`,
      top: `${unified ? top : top + y(first.trace.y[first.k]) - 30}px` });
    Object.assign(this.spike.style, { left: `${place}px`, top: `${top}px`, height: `${high}px` });
    this.readout.hidden = false;
    this.spike.hidden = !unified;
  }

  hide() { this.spike.hidden = this.readout.hidden = true; }
}, '.chart');

// Return the numbers of an array, which Plotly may have packed.
function values(array) {
  if (!array?.bdata) return array;
  return new ARRAYS[array.dtype](Uint8Array.from(atob(array.bdata), (letter) => letter.charCodeAt(0)).buffer);
}

// Return a text without HTML entities, which keep Plotly from interpreting a text as HTML.
function plain(text = '') {
  return text.includes('&') ? new DOMParser().parseFromString(text, 'text/html').documentElement.textContent : text;
}

// Return the text at a point, from a template such as "median: %{y:.3g}".
function filled(trace, k) {
  return plain(trace.hovertemplate.replace(/<extra>.*/, '').replace(/%\{(\w+)(?::\.(\d+)(\w))?\}/g, (_, name, digits, kind) => {
    const value = values(trace[name])[k];
    return digits ? (kind === 'f' ? value.toFixed(digits) : Number(value.toPrecision(digits))) : value;
  }));
}

function scale([low, high], start, end) { return (value) => start + (value - low) / (high - low) * (end - start); }

// Return the values with numbers on an axis, and their texts.
function marksOf({ range: [low, high], tickvals, ticktext, nticks = 9, tickformat }, most) {
  if (tickvals) return Array.from(values(tickvals), (at, k) => ({ at, text: plain(ticktext[k]) }));
  return ticks(low, high, Math.min(nticks, most, tickformat === 'd' ? high - low : nticks));
}

function long(text) { return pen.measureText(text).width; }

// Return a text, cut to a width in pixels.
function cut(text, room) {
  let kept = text;
  while (kept && long(kept === text ? kept : `${kept}…`) > room) kept = kept.slice(0, -1);
  return kept === text ? text : `${kept}…`;
}

function shape(tag, attributes, ...children) {
  const node = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

function words(text, x, y, more) { return shape('text', { x, y, 'text-anchor': 'middle', ...more }, text); }

function lineOf({ x, y, line: { color, width, dash }, fill, fillcolor }, box) {
  let d = '', step = 'M';
  for (let k = 0; k < x.length; k++) {
    const isGap = !Number.isFinite(x[k]) || !Number.isFinite(y[k]);
    if (!isGap) d += `${step}${box.x(x[k]).toFixed(1)} ${box.y(y[k]).toFixed(1)}`;
    step = isGap ? 'M' : 'L';
  }
  return shape('path', { d, fill: fill ? fillcolor : 'none', stroke: width ? color : 'none', 'stroke-width': width,
    'stroke-dasharray': DASHES[dash] ?? 'none', 'stroke-linejoin': 'round' });
}

function dotsOf({ x, y, marker: { size, symbol, color = 'none', opacity = 1, line = {} } }, box) {
  const sizes = values(size);
  const dots = Array.from(x, (value, k) => {
    const r = (sizes[k] ?? sizes) / 2, across = box.x(value), down = box.y(y[k]);
    const d = symbol === 'line-ns' ? `M${across} ${down - 1.4 * r}v${2.8 * r}`
      : `M${across - r} ${down}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0`;
    return shape('path', { d, opacity });
  });
  return shape('g', { class: 'points', fill: color, stroke: line.color ?? 'none', 'stroke-width': line.width ?? 0 }, ...dots);
}
