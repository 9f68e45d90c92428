// The map as an editor of hard data. Tools: pan the map, draw or move a datum, draw a straight or freehand
// line of data, erase. This code is appended to tools.js.
const ERASE = -1, AS_SHOWN = -2;
const AIMABLE = 3; // minimum size in pixels of a cell at which a user can aim
const FINGER = 14; // maximum distance in pixels at which a finger picks a datum
let waiting = []; // edits that the page has not applied; a new canvas sends them

class DataEditor extends ToolMap {
  outbox = new EditQueue((edits) => this.report('edits', edits), waiting);
  brush = 1;
  tool = matchMedia('(pointer: coarse)').matches ? 'pan' : 'draw';

  show(data) {
    this.outbox.taken(data.ack);
    waiting = this.outbox.edits;
    this.applied = data.points;
    super.show({ ...data, points: this.merged(data) });
  }

  // Return the data of the page, changed by edits that the page has not applied yet.
  merged({ points, nx }) {
    this.placed = new Map(points.map((point) => [point[0] * nx + point[1], point]));
    for (const { set } of this.outbox.edits) {
      for (const [row, column, facies] of set || []) {
        const id = row * nx + column;
        if (facies === ERASE) this.placed.delete(id);
        else this.placed.set(id, [row, column, facies, 0, 0]);
      }
    }
    return [...this.placed.values()];
  }

  push(edit) {
    this.outbox.push(edit);
    waiting = this.outbox.edits;
    this.data = { ...this.data, points: this.merged({ ...this.data, points: this.applied }) };
    this.legendOf();
    this.bars();
    this.draw();
  }

  step(what) { this.push({ do: what }); }

  canStep(what) { return what === 'undo' ? this.data.can_undo || this.outbox.edits.length > 0 : this.data.can_redo; }

  place(cells) {
    const set = this.tool === 'erase' ? this.touched(cells)
      : cells.map(([row, column]) => [row, column, this.faciesAt([row, column])]);
    const news = set.filter(([row, column, facies]) => {
      const present = this.datum([row, column]);
      return facies === ERASE ? present : !present || present[2] !== facies;
    });
    if (news.length) this.push({ set: news });
  }

  faciesAt(cell) { return this.brush === AS_SHOWN ? this.indexAt(cell) : this.brush; }

  // Return the data under the eraser: in the crossed cells, or under its tip if cells are tiny.
  touched(cells) {
    const { nx } = this.data;
    const ids = new Set(cells.map(([row, column]) => row * nx + column));
    const reach = this.pixels < AIMABLE ? this.radius / this.pixels : 0;
    return [...this.placed].filter(([id, [row, column]]) => ids.has(id) || (reach
      && cells.some(([r, c]) => Math.hypot(r - row, c - column) <= reach)))
      .map(([, [row, column]]) => [row, column, ERASE]);
  }

  datum([row, column]) { return this.placed.get(row * this.data.nx + column); }

  // If cells are too small to aim at, a tap on the disc of a datum selects that datum.
  aimed(cell) {
    if (this.pixels >= AIMABLE || this.datum(cell)) return cell;
    const cells = [...this.placed.values()];
    const { k, far } = this.nearest(cell, cells);
    return far <= this.radius / this.pixels ? cells[k].slice(0, 2) : cell;
  }

  at(cell) {
    const cellLabel = super.at(cell);
    const datum = cellLabel && this.datum(cell);
    if (!datum) return cellLabel;
    const datumLabel = `datum ${this.data.brushes[datum[2]].label}`;
    return this.data.empty ? datumLabel : `${cellLabel} · ${datumLabel}`;
  }

  point(cell, tell = true) {
    super.point(cell && tell && !this.gesture ? this.aimed(cell) : cell, tell);
  }

  drawInside(pen) {
    super.drawInside(pen);
    const { gesture, pixels: s } = this;
    if (gesture?.moves) {
      this.drawGhost(pen, gesture);
    } else if (gesture) {
      const cells = gesture.cells.filter((cell) => this.inside(cell));
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
  }

  // Draw the moved datum under the pointer, and a line from its cell.
  drawGhost(pen, { moves: [row, column, facies], cells: [to], dragged }) {
    if (!dragged || !this.inside(to)) return;
    const [x, y] = this.toCanvas(to[1] + 0.5, to[0] + 0.5);
    strokeIn(pen, [[PAPER, 3], [INK, 1]], () => {
      pen.moveTo(...this.toCanvas(column + 0.5, row + 0.5));
      pen.lineTo(x, y);
    });
    drawData(pen, [{ x, y, radius: this.radius, colour: this.data.brushes[facies].colour }]);
  }

  drawCross(pen) {
    if (!this.gesture && this.pixels < 5) super.drawCross(pen);
  }

  drawPoints(pen) {
    if (this.shows.corrected) this.drawRings(pen);
    super.drawPoints(pen); // draw data last, so that rings do not hide data
  }

  drawRings(pen) {
    const colour = styleOf(this.root, '--corrected');
    this.data.points.forEach(([row, column, , , help], k) => {
      if (!help) return;
      const radius = this.radiusOf(k), wide = Math.max(1.6, radius * 0.45);
      const place = this.toCanvas(column + 0.5, row + 0.5);
      pen.setLineDash(help < 0 ? [3, 2] : []);
      strokeIn(pen, [[colour, wide]], () => pen.arc(...place, radius + 2 * ringOf(radius) + wide, 0, 2 * Math.PI));
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
    const { brushes, reads } = this.data;
    const box = this.root.querySelector('.brushes');
    const wanted = [...brushes.map((brush, k) => [k, brush.label, brush.colour]),
      ...(reads ? [[AS_SHOWN, 'as shown', null]] : [])];
    if (!wanted.some(([k]) => k === this.brush)) this.brush = 0;
    if (box.dataset.of !== JSON.stringify(wanted)) {
      box.dataset.of = JSON.stringify(wanted);
      box.replaceChildren(...wanted.map(brushButton));
    }
    for (const button of box.children) button.setAttribute('aria-checked', Number(button.dataset.brush) === this.brush);
    super.bars();
  }

  // The choice of a facies also selects a tool that places the facies.
  choose(brush) {
    this.brush = brush;
    if (['pan', 'erase'].includes(this.tool)) this.tool = 'draw';
  }

  press({ brush }) { if (brush) this.choose(Number(brush)); }

  heardByWindow() { return { ...super.heardByWindow(), keydown: (event) => this.typedStep(event) }; }

  // Return the datum that the pointer can move, or null.
  grabbed(event) {
    if (this.tool !== 'draw' || !this.shows.data) return null;
    const { points } = this.data;
    const places = points.map(([row, column]) => this.toCanvas(column + 0.5, row + 0.5));
    const { k, far } = this.nearest(this.spotOf(event), places);
    if (k < 0) return null;
    const radius = this.radiusOf(k), finger = event.pointerType === 'touch' ? FINGER : 0;
    return far <= Math.max(radius + 2 * ringOf(radius), finger) ? points[k] : null;
  }

  grip(event) {
    const cell = this.cellOf(event);
    return this.tool !== 'pan' && this.inside(cell) ? { cells: [cell], moves: this.grabbed(event) } : null;
  }

  follow(gesture, event) {
    const cell = this.cellOf(event), { cells } = gesture;
    if (this.tool === 'draw') gesture.cells = [cell];
    else if (this.tool === 'straight') gesture.cells = cellsBetween(cells[0], cell);
    else cells.push(...cellsBetween(cells.at(-1), cell).slice(1));
    this.pointTo(cell);
  }

  finish({ dragged, moves, cells }, event) {
    const cell = this.cellOf(event);
    if (dragged && moves) this.carry(moves, cell);
    else if (dragged) this.place(cells.filter((each) => this.inside(each)));
    else if (this.inside(cell)) this.place([this.aimed(cell)]);
  }

  // Move a datum to another cell, and replace any datum there. Nothing moves if the page has removed the
  // datum meanwhile, or if the pointer is released outside the map.
  carry([row, column], to) {
    const datum = this.datum([row, column]);
    const same = row === to[0] && column === to[1];
    if (!datum || same || !this.inside(to)) return;
    this.push({ set: [[row, column, ERASE], [...to, datum[2]]] });
  }

  typedKey(key) {
    if (['Enter', ' '].includes(key) && this.hover) this.place([this.hover]);
    else if (['Delete', 'Backspace'].includes(key) && this.hover) {
      if (this.datum(this.hover)) this.push({ set: [[...this.hover, ERASE]] });
    } else if (this.data.brushes[key - 1]) {
      this.choose(key - 1);
      this.bars();
    } else return false;
    return true;
  }

  walkedTo(cell) { super.point(cell); } // without aiming at a datum nearby
}

function brushButton([value, label, colour], place) {
  const title = colour ? `Place ${label} (${place + 1})` : 'Place what the map shows there';
  const parts = colour ? [swatch('swatch', colour), label] : [label];
  const button = element('button', { type: 'button', role: 'radio', title }, ...parts);
  button.dataset.brush = value;
  return button;
}

export default drawnBy(DataEditor, '.map');
