// Drawing functions for maps and volumes: data as ringed circles, axes, legend. This code precedes the modules
// of maps and volumes.
const MARK = 4, SMALLEST_MARK = 1.2, RING = 1.2; // radii of a datum and width of a ring, in pixels
const INK = '#14181d', PAPER = '#ffffff'; // colours of rings, visible on every background

// Draw all rings below all data, so that a ring does not hide the datum beside it. `shape` draws a datum with some
// rings around it, by default a circle.
function drawData(pen, marks, wrongColour, shape = circle) {
  for (const mark of marks) shape(pen, mark, 2, mark.wrong ? wrongColour : INK);
  for (const mark of marks) shape(pen, mark, 1, PAPER);
  for (const mark of marks) shape(pen, mark, 0, mark.colour);
}

function circle(pen, { x, y, radius }, rings, colour) { disc(pen, x, y, radius + rings * ringOf(radius), colour); }

// Return the radius of n data in a picture, smaller if there are many.
function markRadius({ wide, high }, n) {
  const room = Math.sqrt((wide * high) / Math.max(n, 1));
  return Math.max(SMALLEST_MARK, Math.min(MARK, room * 0.13));
}

function ringOf(radius) { return Math.min(RING, radius * 0.4); }

// Write the names of wells [name, x, y] above their positions, inside a box. Nothing is written if there are more
// names than `most`; a name that would overlap an earlier name is left out.
function drawNames(pen, { root, left, wide }, names, most) {
  if (names.length > most) return;
  pen.font = fontOf(root);
  const taken = [];
  for (const [name, at, y] of names) {
    const half = pen.measureText(name).width / 2 + 2;
    const x = clamp(at, left + half, left + wide - half);
    if (taken.some((other) => Math.abs(other.x - x) < other.half + half && Math.abs(other.y - y) < 14)) continue;
    taken.push({ x, y, half });
    drawName(pen, name, x, y);
  }
}

// Write a name above a position, readable on every background.
function drawName(pen, name, x, y) {
  pen.save();
  pen.textAlign = 'center';
  pen.textBaseline = 'bottom';
  pen.lineJoin = 'round';
  pen.lineWidth = 3;
  pen.strokeStyle = PAPER;
  pen.strokeText(name, x, Math.max(y - 6, 14));
  pen.fillStyle = INK;
  pen.fillText(name, x, Math.max(y - 6, 14));
  pen.restore();
}

// Stroke a path in several colours [colour, width, alpha]; later strokes are narrower.
function strokeIn(pen, layers, path) {
  for (const [colour, wide, alpha = 1] of layers) {
    pen.strokeStyle = colour;
    pen.lineWidth = wide;
    pen.globalAlpha = alpha;
    pen.beginPath();
    path();
    pen.stroke();
  }
  pen.globalAlpha = 1;
}

// Add a line through places to a path, with an arrow head of length `head` at the end of the line.
function arrow(pen, places, head) {
  const [[ax, ay], [bx, by]] = places.slice(-2);
  const angle = Math.atan2(by - ay, bx - ax);
  pen.moveTo(...places[0]);
  places.slice(1).forEach((place) => pen.lineTo(...place));
  for (const turn of [0.5, -0.5]) {
    pen.moveTo(bx, by);
    pen.lineTo(bx - head * Math.cos(angle + turn), by - head * Math.sin(angle + turn));
  }
}

// Draw four lines around a position, from a distance of `from` pixels to `wide` or `high` pixels.
function drawCrossAt(pen, x, y, from = 4, [wide, high] = [11, 11], layers = [[PAPER, 3], [INK, 1]]) {
  strokeIn(pen, layers, () => {
    for (const [dx, dy] of [[1, 0], [-1, 0], [0, 1], [0, -1]]) {
      pen.moveTo(x + from * dx, y + from * dy);
      pen.lineTo(x + wide * dx, y + high * dy);
    }
  });
}

// Draw a box (left, top, wide, high) on a canvas, with an edge in the colour of text. `inside` draws the content,
// which is clipped at the edge. If `across` and `up`, the values at the ends, are defined, numbers are written.
function drawFramed(canvas, box, inside, across, up) {
  const pen = canvas.getContext('2d'), { root, left, top, wide, high, dots } = box;
  pen.setTransform(dots, 0, 0, dots, 0, 0);
  pen.clearRect(0, 0, canvas.width, canvas.height);
  pen.save();
  pen.beginPath();
  pen.rect(left, top, wide, high);
  pen.clip();
  inside(pen);
  pen.restore();
  pen.fillStyle = styleOf(root, '--st-text-color');
  pen.font = fontOf(root);
  strokeIn(pen, [[pen.fillStyle, 1, 0.45]], () => pen.rect(left - 0.5, top - 0.5, wide + 1, high + 1));
  if (across) drawAxes(pen, box, across, up);
}

function sizeCanvas(canvas, wide, high, dots) {
  canvas.width = Math.round(wide * dots);
  canvas.height = Math.round(high * dots);
  canvas.style.width = wide + 'px';
  canvas.style.height = high + 'px';
}

function styleOf(root, name) { return getComputedStyle(root).getPropertyValue(name); }

// Draw numbers below and left of a box (left, top, wide, high); a pair contains the values at two edges.
function drawAxes(pen, { left, top, wide, high }, [west, east], [low, upper]) {
  const base = top + high;
  pen.globalAlpha = 0.7;
  pen.textBaseline = 'top';
  pen.textAlign = 'center';
  const room = Math.max(70, ...ticks(west, east, 2).map(({ text }) => pen.measureText(text).width + 24));
  for (const { at, text } of ticks(west, east, wide / room)) {
    const x = left + (at - west) / (east - west) * wide;
    const half = pen.measureText(text).width / 2;
    pen.fillRect(x, base, 1, 4);
    pen.fillText(text, clamp(x, half, left + wide - half), base + 6);
  }
  pen.textAlign = 'right';
  for (const { at, text } of ticks(low, upper, high / 60)) {
    const y = base - (at - low) / (upper - low) * high;
    pen.fillRect(left - 4, y, 4, 1);
    pen.textBaseline = y < top + 8 ? 'top' : y > base - 8 ? 'bottom' : 'middle';
    pen.fillText(text, left - 7, y);
  }
  pen.globalAlpha = 1;
}

// Return the width in pixels of the numbers of some ranges at the left of a box.
function roomForNumbers(canvas, root, ranges) {
  const pen = canvas.getContext('2d');
  pen.font = fontOf(root);
  const marks = ranges.flatMap(([low, high]) => ticks(low, high, 4));
  return Math.max(40, Math.ceil(Math.max(...marks.map(({ text }) => pen.measureText(text).width))) + 9);
}

function fillLegend(legend, { keys, strip, points, points_are: [singular, plural], wrong_label: wrong }) {
  legend.replaceChildren(...keys.map(([label, colour]) => key(label, 'swatch', colour)));
  if (strip) {
    const box = key('', 'strip', null);
    box.firstChild.style.background = `linear-gradient(90deg, ${strip.colours.join(',')})`;
    box.prepend(strip.low);
    box.append(strip.high);
    legend.append(box);
  }
  const n = points.length;
  if (n) legend.append(key(`${n} ${n > 1 ? plural : singular}`, 'swatch round', null));
  if (wrong) legend.append(key(wrong, 'swatch round wrong', null));
}

function fontOf(root) { return '12px ' + styleOf(root, '--st-font'); }

function rgbOf(colour) { return [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16)); }

function disc(pen, x, y, radius, colour) {
  pen.fillStyle = colour;
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

function key(label, kind, colour) { return element('span', { className: 'key' }, swatch(kind, colour), label); }

function swatch(className, colour) {
  const mark = element('span', { className });
  if (colour) mark.style.background = colour;
  return mark;
}

// Return colours as integers, as they are in the pixels of a picture; cells with other indices are transparent.
function paletteOf(lut) {
  const palette = new Uint32Array(256);
  lut.map(rgbOf).forEach(([r, g, b], k) => { palette[k] = (255 << 24) | (b << 16) | (g << 8) | r; });
  return palette;
}

// Return a picture; `paint` sets its pixels.
function pictureOf(wide, high, paint) {
  const picture = new OffscreenCanvas(wide, high);
  const pen = picture.getContext('2d'), pixels = pen.createImageData(wide, high);
  paint(new Uint32Array(pixels.data.buffer));
  pen.putImageData(pixels, 0, 0);
  return picture;
}

// Return the named wells, each with its cells that have a datum.
function wellsWithData({ wells = [], points }, idOf) {
  const occupied = new Set(points.map(idOf));
  const named = wells.map(([name, cells]) => ({ name, cells: cells.filter((cell) => occupied.has(idOf(cell))) }));
  return named.filter(({ cells }) => cells.length);
}
