// The map as an editor of hard data. Tools: pan the map, draw or move a datum, draw a straight or freehand
// line of data, erase; arrow keys move a cursor. This code is appended to map.js and edits.js.
const ERASE = -1, AS_SHOWN = -2;
const AIMABLE = 3; // minimum size in pixels of a cell at which a user can aim
const SLOP = 4, FINGER_SLOP = 8; // maximum movement in pixels of a click; longer movements are drags
const FINGER = 14; // maximum distance in pixels at which a finger picks a datum
const STEPS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
let waiting = []; // edits that the page has not applied; a new canvas sends them

export default inOrder((component) => {
  const editor = drawerOf(component.parentElement.querySelector('.map'), DataEditor);
  editor.queue.send = (edits) => component.setTriggerValue('edits', edits);
  editor.show(component.data);
  return editor.stop;
});

class DataEditor extends CellMap {
  queue = new EditQueue(waiting);
  brush = 1;
  tool = matchMedia('(pointer: coarse)').matches ? 'pan' : 'draw';
  correctedShown = true;
  stroke = null; // stroke of a pressed pointer: the crossed cells, or the moved datum

  // Move the toolbar, which is separate from the map's HTML, into the map.
  constructor(root) {
    root.append(root.nextElementSibling);
    super(root);
    root.classList.add('editor');
    this.canvas.setAttribute('role', 'application');
  }

  show(data) {
    this.queue.taken(data.ack);
    waiting = this.queue.edits;
    this.known = data.points;
    super.show({ ...data, points: this.merged(data) });
    this.bars();
  }

  // Return the data of the page, changed by edits that the page has not applied yet.
  merged({ points, nx }) {
    this.placed = new Map(points.map((point) => [point[0] * nx + point[1], point]));
    for (const { set } of this.queue.edits) {
      for (const [row, column, facies] of set || []) {
        const id = row * nx + column;
        if (facies === ERASE) this.placed.delete(id);
        else this.placed.set(id, [row, column, facies, 0, 0]);
      }
    }
    return [...this.placed.values()];
  }

  push(edit) {
    this.queue.push(edit);
    this.data = { ...this.data, points: this.merged({ ...this.data, points: this.known }) };
    this.legendOf();
    this.bars();
    this.draw();
    waiting = this.queue.edits;
    this.queue.tell();
  }

  place(cells) {
    const set = this.tool === 'erase' ? this.touched(cells)
      : cells.map(([row, column]) => [row, column, this.faciesAt([row, column])]);
    const news = set.filter(([row, column, facies]) => {
      const there = this.datum([row, column]);
      return facies === ERASE ? there : !there || there[2] !== facies;
    });
    if (news.length) this.push({ set: news });
  }

  faciesAt(cell) { return this.brush === AS_SHOWN ? this.indexAt(cell) : this.brush; }

  // Return the data under the eraser: in the crossed cells, or under its tip if cells are tiny.
  touched(cells) {
    const { nx } = this.data;
    const ids = new Set(cells.map(([row, column]) => row * nx + column));
    const reach = this.size1 < AIMABLE ? this.radius / this.size1 : 0;
    return [...this.placed].filter(([id, [row, column]]) => ids.has(id) || (reach
      && cells.some(([r, c]) => Math.hypot(r - row, c - column) <= reach)))
      .map(([, [row, column]]) => [row, column, ERASE]);
  }

  get size1() { return this.cell * this.view.zoom; }

  datum([row, column]) { return this.placed.get(row * this.data.nx + column); }

  inside([row, column]) {
    return row >= 0 && column >= 0 && row < this.data.ny && column < this.data.nx;
  }

  // If cells are too small to aim at, a tap on the disc of a datum selects that datum.
  aimed(cell) {
    if (this.size1 >= AIMABLE || this.datum(cell)) return cell;
    let best = null, least = this.radius / this.size1;
    for (const [row, column] of this.placed.values()) {
      const far = Math.hypot(row - cell[0], column - cell[1]);
      if (far <= least) { least = far; best = [row, column]; }
    }
    return best || cell;
  }

  at(cell) {
    const said = super.at(cell);
    const datum = said && this.datum(cell);
    if (!datum) return said;
    const named = `datum ${this.data.brushes[datum[2]].label}`;
    return this.data.empty ? named : `${said} · ${named}`;
  }

  point(cell, tell = true) {
    super.point(cell && tell && !this.stroke ? this.aimed(cell) : cell, tell);
  }

  draw() {
    super.draw();
    const pen = this.canvas.getContext('2d');
    const s = this.size1;
    pen.save();
    pen.beginPath();
    pen.rect(this.left, this.top, this.wide, this.high);
    pen.clip();
    if (this.stroke?.datum) {
      this.drawGhost(pen, this.stroke);
    } else if (this.stroke) {
      const cells = this.stroke.cells.filter((cell) => this.inside(cell));
      const facies = (cell) => this.tool === 'erase' ? PAPER
        : (this.data.brushes[this.faciesAt(cell)] || { colour: PAPER }).colour;
      for (const [more, colour] of [[4, () => INK], [2, () => PAPER], [0, facies]]) {
        for (const cell of cells) {
          const [x, y] = this.toCanvas(cell[1] + 0.5, cell[0] + 0.5);
          const wide = Math.max(s, 2) + more;
          pen.fillStyle = colour(cell);
          pen.fillRect(x - wide / 2, y - wide / 2, wide, wide);
        }
      }
    } else if (this.hover && s >= 5) {
      const [x, y] = this.toCanvas(this.hover[1], this.hover[0] + 1);
      strokeIn(pen, [[PAPER, 3], [INK, 1]], () => pen.rect(x, y, s, s));
    }
    pen.restore();
  }

  // Draw the moved datum under the pointer, and a line from its cell.
  drawGhost(pen, { datum: [row, column, facies], cells: [to], dragged }) {
    if (!dragged || !this.inside(to)) return;
    const [x, y] = this.toCanvas(to[1] + 0.5, to[0] + 0.5);
    strokeIn(pen, [[PAPER, 3], [INK, 1]], () => {
      pen.moveTo(...this.toCanvas(column + 0.5, row + 0.5));
      pen.lineTo(x, y);
    });
    const { radius } = this;
    disc(pen, x, y, radius + 2 * RING, INK);
    disc(pen, x, y, radius + RING, PAPER);
    disc(pen, x, y, radius, this.data.brushes[facies].colour);
  }

  drawCross(pen) {
    if (!this.stroke && this.size1 < 5) super.drawCross(pen);
  }

  drawPoints(pen) {
    if (this.correctedShown) this.drawRings(pen);
    super.drawPoints(pen); // draw data last, so that rings do not hide data
  }

  drawRings(pen) {
    pen.strokeStyle = getComputedStyle(this.root).getPropertyValue('--corrected');
    this.data.points.forEach(([row, column, , , help], k) => {
      if (!help) return;
      const radius = this.radiusOf(k);
      pen.lineWidth = Math.max(1.6, radius * 0.45);
      const [x, y] = this.toCanvas(column + 0.5, row + 0.5);
      pen.setLineDash(help < 0 ? [3, 2] : []);
      pen.beginPath();
      pen.arc(x, y, radius + 2 * ringOf(radius) + pen.lineWidth, 0, 2 * Math.PI);
      pen.stroke();
    });
    pen.setLineDash([]);
  }

  legendOf() {
    super.legendOf();
    const corrected = this.data.points.filter((point) => point[4] > 0).length;
    const forced = this.data.points.filter((point) => point[4] < 0).length;
    this.root.querySelector('[data-do="corrected"]').hidden = !(corrected + forced);
    if (corrected) this.legend.append(key(`${corrected} corrected`, 'swatch corrected', null));
    if (forced) this.legend.append(key(`${forced} forced`, 'swatch forced', null));
  }

  bars() {
    const { brushes, reads, can_undo: undo, can_redo: redo } = this.data;
    const box = this.root.querySelector('.brushes');
    const wanted = [...brushes.map((brush, k) => [k, brush.label, brush.colour]),
      ...(reads ? [[AS_SHOWN, 'as shown', null]] : [])];
    if (!wanted.some(([k]) => k === this.brush)) this.brush = 0;
    if (box.dataset.of !== JSON.stringify(wanted)) {
      box.dataset.of = JSON.stringify(wanted);
      box.replaceChildren(...wanted.map(brushButton));
    }
    const check = (button, on) => button.setAttribute('aria-checked', on);
    [...box.children].forEach((button) => check(button, Number(button.dataset.brush) === this.brush));
    this.root.querySelectorAll('[data-tool]').forEach((button) => {
      check(button, button.dataset.tool === this.tool);
    });
    this.root.querySelector('[data-step="undo"]').disabled = !undo && !this.queue.edits.length;
    this.root.querySelector('[data-step="redo"]').disabled = !redo;
    this.canvas.classList.toggle('draws', this.tool !== 'pan');
  }

  // The choice of a facies also selects a tool that places the facies.
  choose(brush) {
    this.brush = brush;
    if (['pan', 'erase'].includes(this.tool)) this.tool = 'draw';
  }

  act(what) {
    if (what !== 'corrected') return super.act(what);
    this.correctedShown = !this.correctedShown;
    this.root.querySelector('[data-do="corrected"]').setAttribute('aria-pressed', this.correctedShown);
    this.draw();
  }

  listen() {
    super.listen();
    this.hearFirst({
      pointerdown: this.down, pointermove: this.move, pointerup: this.up,
      pointercancel: this.abandon, dblclick: () => this.tool !== 'pan',
    });
    this.canvas.addEventListener('keydown', (event) => this.typed(event));
    this.root.querySelector('.bar').addEventListener('click', (event) => {
      const { brush, tool, step } = event.target.closest('button')?.dataset || {};
      if (brush) this.choose(Number(brush));
      if (tool) this.tool = tool;
      if (step) this.push({ do: step });
      this.bars();
    });
    this.shortcut = (event) => this.undoKey(event);
  }

  start() {
    window.addEventListener('keydown', this.shortcut);
    super.start();
  }

  stop() {
    this.queue.rest();
    window.removeEventListener('keydown', this.shortcut);
    super.stop();
  }

  // Return the datum that the pointer can move, or null.
  grabbed(event) {
    if (this.tool !== 'draw' || !this.dataShown) return null;
    const [px, py] = this.spotOf(event);
    const finger = event.pointerType === 'touch' ? FINGER : 0;
    let best = null, least = Infinity;
    this.data.points.forEach((point, k) => {
      const [x, y] = this.toCanvas(point[1] + 0.5, point[0] + 0.5);
      const far = Math.hypot(x - px, y - py), radius = this.radiusOf(k);
      if (far < least && far <= Math.max(radius + 2 * ringOf(radius), finger)) {
        [best, least] = [point, far];
      }
    });
    return best;
  }

  // The next four methods return whether they handled the event, so that the map ignores it.
  down(event) {
    if (this.stroke || this.pointers.size) { // a second finger zooms instead of drawing
      if (this.stroke) this.pointers.set(this.stroke.id, this.stroke.spot);
      return this.abandon();
    }
    const cell = this.cellOf(event);
    if (this.tool === 'pan' || event.button !== 0 || !this.inside(cell)) return false;
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    const spot = this.spotOf(event);
    this.stroke = { id: event.pointerId, spot, start: spot, dragged: false, cells: [cell],
      datum: this.grabbed(event) };
    this.draw();
    return true;
  }

  move(event) {
    const { stroke } = this;
    this.canvas.classList.toggle('moves', Boolean(stroke ? stroke.datum : this.grabbed(event)));
    if (stroke?.id !== event.pointerId) return false;
    const cell = this.cellOf(event), { cells } = stroke;
    stroke.spot = this.spotOf(event);
    const far = Math.hypot(stroke.spot[0] - stroke.start[0], stroke.spot[1] - stroke.start[1]);
    stroke.dragged ||= far >= (event.pointerType === 'touch' ? FINGER_SLOP : SLOP);
    if (this.tool === 'draw') stroke.cells = [cell];
    else if (this.tool === 'straight') stroke.cells = cellsBetween(cells[0], cell);
    else cells.push(...cellsBetween(cells[cells.length - 1], cell).slice(1));
    this.point(this.inside(cell) ? cell : null);
    return true;
  }

  up(event) {
    const { stroke } = this;
    if (stroke?.id !== event.pointerId) return false;
    this.abandon();
    const cell = this.cellOf(event);
    if (stroke.dragged && stroke.datum) this.carry(stroke.datum, cell);
    else if (stroke.dragged) this.place(once(stroke.cells.filter((one) => this.inside(one))));
    else if (this.inside(cell)) this.place([this.aimed(cell)]);
    this.draw();
    return true;
  }

  // Move a datum to another cell, and replace any datum there. Nothing moves if the page has removed the
  // datum meanwhile, or if the pointer is released outside the map.
  carry([row, column], to) {
    const datum = this.datum([row, column]);
    const same = row === to[0] && column === to[1];
    if (!datum || same || !this.inside(to)) return;
    this.push({ set: [[row, column, ERASE], [...to, datum[2]]] });
  }

  abandon() {
    this.stroke = null;
    return false;
  }

  typed(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (STEPS[event.key]) this.walk(STEPS[event.key], event.shiftKey ? 10 : 1);
    else if (['Enter', ' '].includes(event.key) && this.hover) this.place([this.hover]);
    else if (['Delete', 'Backspace'].includes(event.key) && this.hover) {
      if (this.datum(this.hover)) this.push({ set: [[...this.hover, ERASE]] });
    } else if (event.key === 'Escape') {
      this.abandon();
      this.draw();
    } else if (this.data.brushes[event.key - 1]) {
      this.choose(event.key - 1);
      this.bars();
    } else return;
    event.preventDefault();
  }

  walk([up, right], far) {
    const { nx, ny } = this.data;
    const [row, column] = this.hover || [Math.floor(this.view.y), Math.floor(this.view.x)];
    const clamp = (v, most) => Math.min(Math.max(v, 0), most - 1);
    const cell = this.hover ? [clamp(row + far * up, ny), clamp(column + far * right, nx)]
      : [clamp(row, ny), clamp(column, nx)];
    const halfX = nx / 2 / this.view.zoom, halfY = ny / 2 / this.view.zoom;
    const near = (v, at, half) => Math.min(Math.max(v, at + 1 - half), at + half);
    this.look({ ...this.view, x: near(this.view.x, cell[1], halfX),
      y: near(this.view.y, cell[0], halfY) });
    this.hover = null;
    super.point(cell);
    this.readout.setAttribute('aria-live', 'polite');
  }

  undoKey(event) {
    const what = stepOf(event);
    if (!what) return;
    event.preventDefault();
    if (!this.root.querySelector(`[data-step="${what}"]`).disabled) this.push({ do: what });
  }
}

// Return all cells along a straight line (Bresenham).
function cellsBetween([row, column], [toRow, toColumn]) {
  const cells = [[row, column]];
  const high = Math.abs(toRow - row), wide = Math.abs(toColumn - column);
  const up = Math.sign(toRow - row), right = Math.sign(toColumn - column);
  let off = wide - high;
  while (row !== toRow || column !== toColumn) {
    const twice = 2 * off;
    if (twice > -high) { off -= high; column += right; }
    if (twice < wide) { off += wide; row += up; }
    cells.push([row, column]);
  }
  return cells;
}

function once(cells) {
  return [...new Map(cells.map((cell) => [cell.join(), cell])).values()];
}

function brushButton([value, label, colour], place) {
  const button = document.createElement('button');
  button.type = 'button';
  button.dataset.brush = value;
  button.setAttribute('role', 'radio');
  button.title = colour ? `Place ${label} (${place + 1})`
    : 'Place what the map shows there';
  if (colour) {
    const mark = document.createElement('span');
    mark.className = 'swatch';
    mark.style.background = colour;
    button.append(mark);
  }
  button.append(label);
  return button;
}
