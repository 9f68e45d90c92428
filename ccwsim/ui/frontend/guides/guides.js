// The map of the guides as a drawing board: a brush draws probabilities, outlines enclose the active cells and
// the zones of images, and lines draw the flow. All positions are world coordinates. This code is appended to
// map.js and edits.js.
const HANDLE = 5, GRIP = 10, FINGER_GRIP = 18; // radius of a corner, and distances at which it is gripped
const TRIES = 30; // maximum number of times that a drawing is sent
const MAX_POINTS = 200; // maximum number of corners of an outline, and of points of a stroke
const ARROW = 0.36; // half of the length of an arrow, as a share of the distance between arrows
const STEPS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const LINE = '#D55E00'; // colour of drawn lines
const BRUSH = { value: 0.8, width: 0.16, softness: 0.5 };

export default inOrder((component) => {
  const board = drawerOf(component.parentElement.querySelector('.map'), GuideBoard);
  board.latest.send = (drawn) => component.setTriggerValue('drawn', drawn);
  board.show(component.data);
  return board.stop;
});

class GuideBoard extends CellMap {
  brush = { ...BRUSH };
  drawn = { outlines: {} }; // {strokes, flow, outlines}; strokes and flow are false if the study has none
  latest = new LatestChoice(TRIES);
  past = [];
  future = [];
  gesture = null; // a pressed pointer: its points, or the corner that it moves
  begun = null; // the first point of a line that is drawn with the keyboard

  constructor(root) {
    root.append(root.nextElementSibling);
    super(root);
    root.classList.add('board');
  }

  show(data) {
    const given = { strokes: data.strokes, flow: data.flow, outlines: data.outlines };
    this.latest.taken(given);
    if (!this.latest.sent) this.drawn = given;
    const before = this.tools || [];
    this.tools = ['pan', ...(data.strokes ? ['brush'] : []), ...(data.flow ? ['line'] : []),
      ...Object.keys(data.outlines)];
    if (this.tools.length === 1) this.tools = [];
    for (const tool of this.tools)
      if (!this.root.querySelector(`[data-tool="${tool}"]`)) this.addZone(tool);
    const news = this.tools.filter((tool) => !before.includes(tool) && tool !== 'pan');
    if (news.length && !matchMedia('(pointer: coarse)').matches) this.tool = news.at(-1);
    if (!this.tools.includes(this.tool)) this.tool = 'pan';
    this.canvas.setAttribute('role', this.tools.length ? 'application' : 'img');
    super.show(data);
    this.bars();
  }

  // Add the button of a zone, which is like that of the outline of the active cells.
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
    this.latest.tell(this.drawn);
    this.bars();
    this.draw();
  }

  step(what) {
    const { strokes, flow } = this.drawn;
    if (what === 'clear') return this.push({ strokes: strokes && [], flow: flow && [] });
    const [from, to] = what === 'undo' ? [this.past, this.future] : [this.future, this.past];
    if (!from.length) return null;
    to.push(this.drawn);
    return this.push(from.pop(), false);
  }

  bars() {
    const radio = (button) => {
      button.hidden = !this.tools.includes(button.dataset.tool);
      button.setAttribute('aria-checked', button.dataset.tool === this.tool);
    };
    this.root.querySelectorAll('[data-tool]').forEach(radio);
    const step = (what, there, none) => {
      const button = this.root.querySelector(`[data-step="${what}"]`);
      button.hidden = !this.tools.length || none;
      button.disabled = !there;
    };
    step('undo', this.past.length);
    step('redo', this.future.length);
    const { strokes, flow } = this.drawn;
    step('clear', strokes?.length || flow?.length, !strokes && !flow);
    this.root.querySelector('.sliders').hidden = this.tool !== 'brush';
    for (const input of this.root.querySelectorAll('.sliders input')) {
      input.value = this.brush[input.dataset.of];
      input.previousElementSibling.value = this.said(input.dataset.of);
    }
    this.canvas.classList.toggle('draws', this.tool !== 'pan');
  }

  // Return the corners that the tool moves, if it is an outline.
  get corners() { return this.drawn.outlines[this.tool]; }

  pushCorners(corners) { this.push({ outlines: { ...this.drawn.outlines, [this.tool]: corners } }); }

  said(of) {
    if (of !== 'width') return `${Math.round(100 * this.brush[of])} %`;
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
      const decimals = Math.min(Math.max(2 - Math.floor(Math.log10(size[axis])), 0), 20);
      return Number((origin[axis] + k * size[axis]).toFixed(decimals));
    });
  }

  fromWorld([x, y]) {
    const { cell_size: [sx, sy], origin } = this.data;
    return this.toCanvas((x - origin[0]) / sx, (y - origin[1]) / sy);
  }

  worldOf(event) { return this.toWorld(this.within(this.toCells(...this.spotOf(event)))); }

  within([x, y]) {
    return [Math.min(Math.max(x, 0), this.data.nx), Math.min(Math.max(y, 0), this.data.ny)];
  }

  draw() {
    super.draw();
    const pen = this.canvas.getContext('2d');
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top, this.wide, this.high);
    pen.clip();
    const { gesture } = this, { strokes, flow, outlines } = this.drawn;
    (strokes || []).slice((this.data.strokes || []).length).forEach((s) => this.drawStroke(pen, s));
    if (gesture?.brush) this.drawStroke(pen, this.strokeOf(gesture.points));
    this.drawArrows(pen);
    (flow || []).forEach((line) => this.drawLine(pen, line));
    if (gesture?.line) this.drawLine(pen, gesture.points);
    if (this.begun) this.drawLine(pen, [this.begun]);
    for (const [tool, corners] of Object.entries(outlines)) {
      const mine = this.tool === tool;
      this.drawOutline(pen, (mine && gesture?.corners) || corners, mine);
    }
    if (gesture?.lasso && gesture.points.length > 1) this.drawOutline(pen, gesture.points, false);
    if (this.tool === 'brush' && this.spot) this.drawTip(pen, this.spot);
    pen.restore();
  }

  drawStroke(pen, [value, radius, softness, points]) {
    const { lut, cell_size: [sx] } = this.data;
    pen.strokeStyle = lut[Math.round(value * (lut.length - 1))];
    pen.lineCap = pen.lineJoin = 'round';
    const wide = 2 * radius / sx * this.cell * this.view.zoom;
    for (const [share, alpha] of [[1 - softness / 3, 0.45], [1 - softness, 0.6]]) {
      pen.globalAlpha = alpha;
      pen.lineWidth = Math.max(wide * share, 1);
      pen.beginPath();
      points.forEach((point, k) => (k ? pen.lineTo : pen.moveTo).apply(pen, this.fromWorld(point)));
      if (points.length === 1) pen.lineTo(...this.fromWorld(points[0]));
      pen.stroke();
    }
    pen.globalAlpha = 1;
  }

  // Draw short arrows in the direction of azimuths; cells are drawn as squares, whatever their size.
  drawArrows(pen) {
    const { arrows, cell_size: [sx, sy] } = this.data;
    if (!arrows) return;
    const far = Math.max(ARROW * arrows.every * this.cell * this.view.zoom, 3);
    strokeIn(pen, [[PAPER, 3, 0.6], [INK, 1.1, 0.75]], () => {
      for (const [x, y, azimuth] of arrows.at) {
        const [east, north] = [Math.sin(azimuth * Math.PI / 180) / sx, Math.cos(azimuth * Math.PI / 180) / sy];
        const long = far / Math.hypot(east, north);
        const [px, py] = this.fromWorld([x, y]);
        arrow(pen, [px - east * long, py + north * long], [px + east * long, py - north * long], far / 2);
      }
    });
  }

  drawLine(pen, line) {
    const places = line.map((point) => this.fromWorld(point));
    if (places.length === 1) return disc(pen, ...places[0], 3, LINE);
    return strokeIn(pen, [[PAPER, 5, 0.9], [LINE, 2.5]], () => {
      places.slice(0, -1).forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      const [last, end] = places.slice(-2);
      arrow(pen, last, end, 9, places.length > 2);
    });
  }

  drawOutline(pen, corners, handles) {
    const places = corners.map((corner) => this.fromWorld(corner));
    strokeIn(pen, [[PAPER, 3.5, 0.9], [INK, 1.5]], () => {
      places.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      pen.closePath();
    });
    for (const [x, y] of handles ? places : []) {
      disc(pen, x, y, HANDLE, INK);
      disc(pen, x, y, HANDLE - 1.5, PAPER);
    }
  }

  // Draw the edge of the brush, and the part of its full strength.
  drawTip(pen, [x, y]) {
    const { cell_size: [sx] } = this.data;
    const radius = this.half / sx * this.cell * this.view.zoom;
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
    this.hearFirst({
      pointerdown: this.down, pointermove: this.move, pointerup: this.up,
      pointercancel: this.abandon, dblclick: this.removed,
      pointerleave: () => { this.spot = null; return false; },
    });
    this.canvas.addEventListener('keydown', (event) => this.typed(event));
    const bar = this.root.querySelector('.bar');
    bar.addEventListener('click', (event) => {
      const { tool, step } = event.target.closest('button')?.dataset || {};
      if (tool) this.tool = tool;
      if (step) this.step(step);
      this.bars();
      this.draw();
    });
    bar.addEventListener('input', ({ target }) => {
      if (target.dataset.of) this.brush[target.dataset.of] = Number(target.value);
      this.bars();
    });
  }

  // Return the number of the nearest corner, or a corner to add to the nearest edge, if one is near.
  gripped(event, adds = true) {
    const spot = this.spotOf(event), { corners } = this;
    const reach = event.pointerType === 'touch' ? FINGER_GRIP : GRIP;
    const places = corners.map((corner) => this.fromWorld(corner));
    const far = places.map((place) => Math.hypot(place[0] - spot[0], place[1] - spot[1]));
    const nearest = far.indexOf(Math.min(...far));
    if (far[nearest] <= reach) return { at: nearest, corners: [...corners] };
    const edges = places.map((a, k) => distance(spot, a, places[(k + 1) % places.length]));
    const edge = edges.indexOf(Math.min(...edges));
    if (!adds || edges[edge] > reach || corners.length >= MAX_POINTS) return null;
    return { at: edge + 1, corners: corners.toSpliced(edge + 1, 0, this.worldOf(event)) };
  }

  down(event) {
    if (this.gesture || this.pointers.size) return this.abandon(); // a second finger zooms
    if (!this.tools.includes(this.tool) || this.tool === 'pan' || event.button !== 0) return false;
    if (!this.at(this.cellOf(event)) && !this.corners) return false;
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    const grip = this.corners ? this.gripped(event) : null;
    this.gesture = { id: event.pointerId, points: [this.worldOf(event)], brush: this.tool === 'brush',
      line: this.tool === 'line', lasso: this.corners && !grip, ...grip };
    this.draw();
    return true;
  }

  move(event) {
    const { gesture } = this;
    this.spot = this.spotOf(event);
    const held = this.corners && (gesture ? gesture.corners : this.gripped(event));
    this.canvas.classList.toggle('moves', Boolean(held));
    if (gesture?.id !== event.pointerId) return false;
    const place = this.worldOf(event);
    gesture.dragged = true;
    if (gesture.corners) gesture.corners[gesture.at] = place;
    else gesture.points.push(place);
    const cell = this.cellOf(event);
    this.point(this.at(cell) ? cell : null);
    return true;
  }

  up(event) {
    const { gesture } = this;
    if (gesture?.id !== event.pointerId) return false;
    this.abandon();
    const points = simpler(gesture.points, 2 * this.data.cell_size[0] / (this.cell * this.view.zoom));
    if (gesture.brush) this.paint(gesture.points);
    else if (gesture.line) this.pushLine(points);
    else if (gesture.corners && gesture.dragged) this.pushCorners(gesture.corners);
    else if (gesture.lasso && points.length > 2) this.pushCorners(points);
    this.draw();
    return true;
  }

  paint(points) { this.push({ strokes: [...this.drawn.strokes, this.strokeOf(points)] }); }

  pushLine(line) {
    if (line.some((point) => !isSame(point, line[0]))) this.push({ flow: [...this.drawn.flow, line] });
  }

  abandon() {
    this.gesture = this.begun = null;
    return false;
  }

  // Remove the corner that is clicked twice.
  removed(event) {
    if (!this.corners) return this.tool !== 'pan';
    const grip = this.gripped(event, false);
    if (grip && this.corners.length > 3) this.pushCorners(this.corners.toSpliced(grip.at, 1));
    return true;
  }

  // Arrow keys move a cursor. Enter paints there, begins or ends a line, or moves the nearest corner there.
  typed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return this.undoKey(event);
    if (STEPS[event.key]) this.walk(STEPS[event.key], event.shiftKey ? 10 : 1);
    else if (event.key === 'Escape') this.abandon();
    else if (['Enter', ' '].includes(event.key) && this.hover) {
      const place = this.toWorld([this.hover[1] + 0.5, this.hover[0] + 0.5]);
      if (this.tool === 'brush') this.paint([place]);
      if (this.tool === 'line') {
        const { begun } = this;
        this.begun = begun ? null : place;
        if (begun) this.pushLine([begun, place]);
        this.draw();
      }
      if (this.corners) {
        const far = this.corners.map(([x, y]) => Math.hypot(x - place[0], y - place[1]));
        this.pushCorners(this.corners.with(far.indexOf(Math.min(...far)), place));
      }
    } else return;
    event.preventDefault();
  }

  walk([up, right], far) {
    const { nx, ny } = this.data;
    const [row, column] = this.hover || [Math.floor(ny / 2), Math.floor(nx / 2)];
    const clamp = (v, n) => Math.min(Math.max(v, 0), n - 1);
    const cell = [clamp(row + far * up, ny), clamp(column + far * right, nx)];
    this.spot = this.toCanvas(cell[1] + 0.5, cell[0] + 0.5);
    this.point(cell);
    this.readout.setAttribute('aria-live', 'polite');
  }

  undoKey(event) {
    const what = stepOf(event);
    if (!what || !(what === 'undo' ? this.past : this.future).length) return;
    event.preventDefault();
    event.stopPropagation(); // the page also has an undo
    this.step(what);
  }

  stop() {
    this.latest.rest();
    super.stop();
  }
}

function distance([x, y], [ax, ay], [bx, by]) {
  const [wx, wy] = [bx - ax, by - ay];
  const t = Math.min(Math.max(((x - ax) * wx + (y - ay) * wy) / (wx * wx + wy * wy || 1), 0), 1);
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
