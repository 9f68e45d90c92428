// The map of the guides as a drawing board: a brush draws probabilities, outlines enclose the active cells and
// the zones of images, and lines draw the flow. All positions are world coordinates. This code is appended to
// tools.js.
const HANDLE = 5, GRIP = 10, FINGER_GRIP = 18; // radius of a corner, and distances at which it is gripped
const MAX_POINTS = 200; // maximum number of corners of an outline, and of points of a stroke
const ARROW = 0.36; // half of the length of an arrow, as a share of the distance between arrows
const LINE = '#D55E00'; // colour of drawn lines
const LEAST_HEIGHT = 320, AROUND = 250, SLIDERS = 80; // minimum height of the map; pixels of the rest of the page
const BRUSH = { value: 0.8, width: 0.16, softness: 0.5 };

class GuideBoard extends ToolMap {
  brush = { ...BRUSH };
  drawn = { outlines: {} }; // {strokes, flow, outlines}; strokes and flow are false if the study has none
  outbox = new LatestChoice((drawn) => this.report('drawn', drawn));
  past = [];
  future = [];
  begun = null; // the first point of a line that is drawn with the keyboard

  show(data) {
    const applied = { strokes: data.strokes, flow: data.flow, outlines: data.outlines };
    this.outbox.taken(applied);
    if (!this.outbox.sent) this.drawn = applied;
    const before = this.tools || [];
    const possible = [...(data.strokes ? ['brush'] : []), ...(data.flow ? ['line'] : []), ...Object.keys(data.outlines)];
    this.tools = ['pan', ...possible.filter((tool) => tool.startsWith(data.tool))];
    if (this.tools.length === 1) this.tools = [];
    for (const tool of this.tools)
      if (!this.root.querySelector(`[data-tool="${tool}"]`)) this.addZone(tool);
    const news = this.tools.filter((tool) => !before.includes(tool) && tool !== 'pan');
    if (news.length && !matchMedia('(pointer: coarse)').matches) this.tool = news.at(-1);
    if (!this.tools.includes(this.tool)) this.tool = 'pan';
    super.show(data);
    if (!this.tools.length) this.canvas.setAttribute('role', 'img');
  }

  // The map is as high as the window allows.
  layout() {
    const around = AROUND + (this.tools.includes('brush') ? SLIDERS : 0);
    this.data.max_height = Math.max(LEAST_HEIGHT, window.innerHeight - around);
    super.layout();
  }

  // Add the button of a zone, a copy of the button of the outline of the active cells.
  addZone(tool) {
    const like = this.root.querySelector('[data-tool="outline"]'), button = like.cloneNode(true);
    const number = tool.replace('zone', '');
    button.dataset.tool = tool;
    button.title = like.title.replace('the active cells', `the cells of image ${number}`);
    button.lastChild.data = `zone ${number}`;
    like.parentElement.append(button);
  }

  // Replace the drawing; it is sent again until the page has applied it.
  push(changes, remember = true) {
    if (remember) {
      this.past.push(this.drawn);
      this.future = [];
    }
    this.drawn = { ...this.drawn, ...changes };
    this.outbox.tell(this.drawn);
    this.bars();
    this.draw();
  }

  step(what) {
    if (what === 'clear') return this.push(this.tools.includes('brush') ? { strokes: [] } : { flow: [] });
    const [from, to] = what === 'undo' ? [this.past, this.future] : [this.future, this.past];
    to.push(this.drawn);
    return this.push(from.pop(), false);
  }

  canStep(what) { return { undo: this.past, redo: this.future, clear: this.clearable }[what]?.length > 0; }

  // Return the strokes or the lines of the task, or null if the tool draws neither.
  get clearable() {
    const { strokes, flow } = this.drawn;
    return this.tools.includes('brush') ? strokes : this.tools.includes('line') ? flow : null;
  }

  bars() {
    super.bars();
    for (const button of this.root.querySelectorAll('[data-tool]'))
      button.hidden = !this.tools.includes(button.dataset.tool);
    for (const button of this.root.querySelectorAll('[data-step]')) button.hidden = !this.tools.length;
    if (!this.clearable) this.root.querySelector('[data-step="clear"]').hidden = true;
    this.root.querySelector('.sliders').hidden = this.tool !== 'brush';
    for (const input of this.root.querySelectorAll('.sliders input')) {
      input.value = this.brush[input.dataset.of];
      input.previousElementSibling.value = this.brushText(input.dataset.of);
    }
  }

  // Return the corners that the tool moves, if it is an outline.
  get corners() { return this.drawn.outlines[this.tool]; }

  pushCorners(corners) { this.push({ outlines: { ...this.drawn.outlines, [this.tool]: corners } }); }

  brushText(name) {
    if (name !== 'width') return `${Math.round(100 * this.brush[name])} %`;
    return String(Number((2 * this.half).toPrecision(2)));
  }

  // Return half of the width of the brush in world coordinates.
  get half() {
    const { nx, ny, cell_size: [sx, sy] } = this.data;
    return this.brush.width * Math.min(nx * sx, ny * sy) / 2;
  }

  // Return world coordinates, rounded to a hundredth of a cell.
  toWorld(place) {
    const { cell_size: size, origin } = this.data;
    return place.map((k, axis) => {
      const decimals = clamp(2 - Math.floor(Math.log10(size[axis])), 0, 20);
      return Number((origin[axis] + k * size[axis]).toFixed(decimals));
    });
  }

  fromWorld([x, y]) {
    const { cell_size: [sx, sy], origin } = this.data;
    return this.toCanvas((x - origin[0]) / sx, (y - origin[1]) / sy);
  }

  worldOf(event) {
    const [x, y] = this.toCells(...this.spotOf(event));
    return this.toWorld([clamp(x, 0, this.data.nx), clamp(y, 0, this.data.ny)]);
  }

  drawInside(pen) {
    super.drawInside(pen);
    const { gesture } = this, { strokes, flow, outlines } = this.drawn;
    (strokes || []).slice((this.data.strokes || []).length).forEach((s) => this.drawStroke(pen, s));
    if (gesture?.brush) this.drawStroke(pen, this.strokeOf(gesture.points));
    this.drawArrows(pen);
    (flow || []).forEach((line) => this.drawLine(pen, line));
    if (gesture?.line) this.drawLine(pen, gesture.points);
    if (this.begun) this.drawLine(pen, [this.begun]);
    for (const [tool, corners] of Object.entries(outlines)) {
      const mine = this.tool === tool;
      this.drawOutline(pen, (mine && gesture?.moves) || corners, mine);
    }
    if (gesture?.lasso && gesture.points.length > 1) this.drawOutline(pen, gesture.points, false);
    if (this.tool === 'brush' && this.spot) this.drawTip(pen, this.spot);
  }

  drawStroke(pen, [value, radius, softness, points]) {
    const { lut, cell_size: [sx] } = this.data;
    pen.strokeStyle = lut[Math.round(value * (lut.length - 1))];
    pen.lineCap = pen.lineJoin = 'round';
    const wide = 2 * radius / sx * this.pixels;
    for (const [share, alpha] of [[1 - softness / 3, 0.45], [1 - softness, 0.6]]) {
      pen.globalAlpha = alpha;
      pen.lineWidth = Math.max(wide * share, 1);
      pen.beginPath();
      points.forEach((point) => pen.lineTo(...this.fromWorld(point)));
      if (points.length === 1) pen.lineTo(...this.fromWorld(points[0]));
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  // Draw short arrows in the direction of azimuths; cells are drawn as squares, even if they are not square.
  drawArrows(pen) {
    const { arrows, cell_size: [sx, sy] } = this.data;
    if (!arrows) return;
    const far = Math.max(ARROW * arrows.every * this.pixels, 3);
    strokeIn(pen, [[PAPER, 3, 0.6], [INK, 1.1, 0.75]], () => {
      for (const [x, y, azimuth] of arrows.at) {
        const [east, north] = [Math.sin(azimuth * Math.PI / 180) / sx, Math.cos(azimuth * Math.PI / 180) / sy];
        const long = far / Math.hypot(east, north);
        const [px, py] = this.fromWorld([x, y]);
        arrow(pen, [[px - east * long, py + north * long], [px + east * long, py - north * long]], far / 2);
      }
    });
  }

  drawLine(pen, line) {
    const places = line.map((point) => this.fromWorld(point));
    if (places.length === 1) return disc(pen, ...places[0], 3, LINE);
    return strokeIn(pen, [[PAPER, 5, 0.9], [LINE, 2.5]], () => arrow(pen, places, 9));
  }

  drawOutline(pen, corners, handles) {
    const places = corners.map((corner) => this.fromWorld(corner));
    strokeIn(pen, [[PAPER, 3.5, 0.9], [INK, 1.5]], () => {
      places.forEach((place) => pen.lineTo(...place));
      pen.closePath();
    });
    for (const [x, y] of handles ? places : []) {
      disc(pen, x, y, HANDLE, INK);
      disc(pen, x, y, HANDLE - 1.5, PAPER);
    }
  }

  // Draw the edge of the brush, and the edge of the part with full strength.
  drawTip(pen, [x, y]) {
    const { cell_size: [sx] } = this.data;
    const radius = this.half / sx * this.pixels;
    strokeIn(pen, [[PAPER, 3, 0.9], [INK, 1.2]], () => pen.arc(x, y, radius, 0, 2 * Math.PI));
    const inner = radius * (1 - this.brush.softness);
    if (inner > 2) strokeIn(pen, [[PAPER, 1, 0.9]], () => pen.arc(x, y, inner, 0, 2 * Math.PI));
  }

  drawCross(pen) {
    if (this.tool !== 'brush' || !this.spot) super.drawCross(pen);
  }

  strokeOf(points) {
    const { value, softness } = this.brush;
    return [value, Number(this.half.toPrecision(6)), softness, simpler(points, this.half / 8)];
  }

  listen() {
    super.listen();
    this.root.querySelector('.sliders').addEventListener('input', ({ target }) => {
      if (target.dataset.of) this.brush[target.dataset.of] = Number(target.value);
      this.bars();
    });
  }

  // Return the number of the nearest corner or of a corner added to the nearest edge, with all corners, if one is near.
  corner(event, adds = true) {
    const spot = this.spotOf(event), { corners } = this;
    const reach = event.pointerType === 'touch' ? FINGER_GRIP : GRIP;
    const places = corners.map((corner) => this.fromWorld(corner));
    const { k: at, far } = this.nearest(spot, places);
    if (far <= reach) return { at, moves: [...corners] };
    const edges = places.map((a, k) => distance(spot, a, places[(k + 1) % places.length]));
    const edge = edges.indexOf(Math.min(...edges));
    if (!adds || edges[edge] > reach || corners.length >= MAX_POINTS) return null;
    return { at: edge + 1, moves: corners.toSpliced(edge + 1, 0, this.worldOf(event)) };
  }

  // A gesture contains the drawn points, or the corners of an outline and the number of the moved corner.
  grip(event) {
    if (this.tool === 'pan' || (!this.at(this.cellOf(event)) && !this.corners)) return null;
    const corner = this.corners && this.corner(event);
    return corner || { points: [this.worldOf(event)], [this.corners ? 'lasso' : this.tool]: true };
  }

  follow(gesture, event) {
    const place = this.worldOf(event);
    if (gesture.moves) gesture.moves[gesture.at] = place;
    else gesture.points.push(place);
    this.pointTo(this.cellOf(event));
  }

  finish({ brush, line, lasso, moves, dragged, points }) {
    if (brush) this.paint(points);
    if (moves && dragged) this.pushCorners(moves);
    if (!line && !lasso) return;
    const simple = simpler(points, 2 * this.data.cell_size[0] / this.pixels);
    if (line) this.pushLine(simple);
    else if (simple.length > 2) this.pushCorners(simple);
  }

  paint(points) { this.push({ strokes: [...this.drawn.strokes, this.strokeOf(points)] }); }

  pushLine(line) {
    if (line.some((point) => !isSame(point, line[0]))) this.push({ flow: [...this.drawn.flow, line] });
  }

  abandon() {
    this.begun = null;
    super.abandon();
  }

  // Remove the corner that is clicked twice.
  dblclick(event) {
    if (!this.corners) return super.dblclick(event);
    const grip = this.corner(event, false);
    if (grip && this.corners.length > 3) this.pushCorners(this.corners.toSpliced(grip.at, 1));
    return null;
  }

  // Enter paints at the cursor, begins or ends a line, or moves the nearest corner to the cursor.
  typedKey(key) {
    if (!['Enter', ' '].includes(key) || !this.hover) return false;
    const place = this.toWorld([this.hover[1] + 0.5, this.hover[0] + 0.5]);
    if (this.tool === 'brush') this.paint([place]);
    if (this.tool === 'line') {
      const { begun } = this;
      this.begun = begun ? null : place;
      if (begun) this.pushLine([begun, place]);
      this.draw();
    }
    if (this.corners) this.pushCorners(this.corners.with(this.nearest(place, this.corners).k, place));
    return true;
  }
}

function distance([x, y], [ax, ay], [bx, by]) {
  const [wx, wy] = [bx - ax, by - ay];
  const t = clamp(((x - ax) * wx + (y - ay) * wy) / (wx * wx + wy * wy || 1), 0, 1);
  return Math.hypot(x - ax - t * wx, y - ay - t * wy);
}

// Return a line with fewer points, at most `tolerance` from the given line (Douglas and Peucker).
function simpler(points, tolerance) {
  const kept = (first, last) => {
    let best = 0, at = -1;
    for (let k = first + 1; k < last; k++) {
      const far = distance(points[k], points[first], points[last]);
      if (far > best) [best, at] = [far, k];
    }
    if (best <= tolerance) return [points[first]];
    return [...kept(first, at), ...kept(at, last)];
  };
  const line = points.length > 1 ? [...kept(0, points.length - 1), points.at(-1)] : points;
  return line.length > MAX_POINTS ? simpler(points, 2 * tolerance) : line;
}

export default drawnBy(GuideBoard, '.map');
