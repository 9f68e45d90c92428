// A map of flow: a click places the well, and well and heads of two sides are dragged while the page solves the
// flow. This code is appended to tools.js.
const GRIP = 12, FINGER_GRIP = 22; // distances in pixels at which something is gripped
const TAB = { wide: 52, high: 22 }; // size in pixels of the tab that shows the head of a side
const STEP = 8; // pixels by which a tab is dragged to change the head by one step

class FlowMap extends ToolMap {
  chosen = {}; // well (row and column, or null) and heads, also before the page has applied them
  outbox = new LatestChoice((chosen) => this.report('chosen', chosen));

  // During a gesture, the page applies one choice after another; the latest choice is always sent.
  show(data) {
    this.pageChoice = { well: data.well, heads: data.heads };
    const applied = this.outbox.taken(this.pageChoice);
    if (this.outbox.sent) this.outbox.insist();
    else if (!applied && !this.gesture) this.chosen = this.pageChoice;
    super.show({ ...data });
    if (applied) this.offer();
  }

  // Change the choice, and send it unless an earlier one is still on its way.
  choose(changes) {
    this.chosen = { ...this.chosen, ...changes };
    this.draw();
    this.offer();
  }

  offer() {
    if (!this.outbox.sent && !isSame(this.chosen, this.pageChoice)) this.outbox.tell(this.chosen);
  }

  draw() {
    const { data, chosen: { well } } = this;
    data.marks = data.marks.filter(({ kind }) => kind !== 'ring');
    if (well) {
      data.marks.push({ kind: 'ring', row: well[0], column: well[1], height: 1, width: 1,
        colour: data.well_colour, label: data.well_label });
    }
    super.draw();
  }

  drawInside(pen) {
    super.drawInside(pen);
    const { heads } = this.chosen;
    if (heads) this.tabs().forEach((place, end) => this.drawTab(pen, place, heads[end]));
  }

  // Return the middles of the tabs at both sides with fixed heads.
  tabs() {
    const { left, top, wide, high } = this;
    const [x, y] = [TAB.wide / 2 + 3, TAB.high / 2 + 3];
    if (this.data.axis === 'y') return [[left + wide / 2, top + high - y], [left + wide / 2, top + y]];
    return [[left + x, top + high / 2], [left + wide - x, top + high / 2]];
  }

  drawTab(pen, [x, y], head) {
    const { wide, high } = TAB;
    pen.beginPath();
    pen.roundRect(x - wide / 2, y - high / 2, wide, high, 4);
    pen.fillStyle = PAPER;
    pen.fill();
    pen.strokeStyle = pen.fillStyle = INK;
    pen.lineWidth = 1;
    pen.stroke();
    pen.font = fontOf(this.root);
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    pen.fillText(`${head} m ↕`, x, y + 0.5, wide - 6);
  }

  listen() {
    super.listen();
    // a finger on a handle does not scroll the page
    this.canvas.addEventListener('touchstart', (event) => this.gesture && event.preventDefault(), { passive: false });
  }

  // A gesture moves the head of an end (0 or 1), or the well; `off` is from the pointer to the middle of the well.
  grip(event) {
    const [x, y] = this.spotOf(event), { well, heads } = this.chosen;
    const reach = event.pointerType === 'touch' ? FINGER_GRIP : GRIP;
    const end = heads ? this.tabs().findIndex(([tx, ty]) => (
      Math.abs(x - tx) <= TAB.wide / 2 && Math.abs(y - ty) <= Math.max(TAB.high / 2, reach))) : -1;
    if (end >= 0) return { moves: 'head', end, heads };
    if (!well) return null;
    const [wx, wy] = this.toCanvas(well[1] + 0.5, well[0] + 0.5);
    return Math.hypot(x - wx, y - wy) <= reach ? { moves: 'well', off: [wx - x, wy - y] } : null;
  }

  follow({ spot: [x, y], start, off, end, heads }) {
    if (!off) return this.lift(end, heads, Math.round((start[1] - y) / STEP));
    const [column, row] = this.toCells(x + off[0], y + off[1]);
    return this.walkedTo([Math.floor(row), Math.floor(column)]);
  }

  pick(cell) { this.place(cell); }

  // Place the well in a cell, if water can flow in the cell.
  place(cell) {
    const conducts = this.data.labels[this.indexAt(cell)] !== undefined;
    if (conducts && !isSame(cell, this.chosen.well)) this.choose({ well: cell });
  }

  // Raise the head of an end by steps of about a tenth of the difference of the heads, unless they become equal.
  lift(end, heads, steps) {
    const size = 10 ** Math.floor(Math.log10(Math.abs(heads[0] - heads[1]) / 5));
    const head = Number((heads[end] + steps * size).toPrecision(6));
    if (head !== heads[1 - end] && head !== this.chosen.heads[end]) this.choose({ heads: heads.with(end, head) });
  }

  // Arrow keys move the well, and Enter places it.
  get cursor() { return this.chosen.well; }

  walkedTo(cell) {
    this.place(cell);
    this.point(this.chosen.well);
  }

  typedKey(key) {
    if (key === 'Enter') this.walk([0, 0]);
    return key === 'Enter';
  }
}

export default drawnBy(FlowMap, '.map');
