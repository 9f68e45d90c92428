// A map of flow: a click places the well, and well and heads of two sides are dragged while the page solves the
// flow. This code is appended to map.js and edits.js.
const GRIP = 12, FINGER_GRIP = 22; // distances in pixels at which something is gripped
const TAB = { wide: 52, high: 22 }; // size in pixels of the tab that shows the head of a side
const STEP = 8; // pixels by which a tab is dragged to change the head by one step
const TRIES = 10; // maximum number of times that a choice is sent
const WAYS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1], Enter: [0, 0] };

export default inOrder((component) => {
  const map = drawerOf(component.parentElement.querySelector('.map'), FlowMap);
  map.latest.send = (chosen) => component.setTriggerValue('chosen', chosen);
  map.show(component.data);
  return map.stop;
});

class FlowMap extends CellMap {
  chosen = {}; // well (row and column, or null) and heads, also before the page has applied them
  latest = new LatestChoice(TRIES);
  gesture = null; // a pressed pointer, and what it moves: the well, or the head of an end (0 or 1)

  // While the pointer is down, the page answers one choice after another; the latest is always sent.
  show(data) {
    this.given = { well: data.well, heads: data.heads };
    const applied = this.latest.taken(this.given);
    if (this.latest.sent) this.latest.insist();
    else if (!applied && !this.gesture) this.chosen = this.given;
    this.canvas.setAttribute('role', 'application');
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
    if (!this.latest.sent && !isSame(this.chosen, this.given)) this.latest.tell(this.chosen);
  }

  draw() {
    const { data, chosen: { well, heads } } = this;
    data.marks = data.marks.filter(({ kind }) => kind !== 'ring');
    if (well) {
      data.marks.push({ kind: 'ring', row: well[0], column: well[1], height: 1, width: 1,
        colour: data.well_colour, label: data.well_label });
    }
    super.draw();
    if (heads) this.tabs().forEach((place, end) => this.drawTab(place, heads[end]));
  }

  // Return the middles of the tabs at both sides with fixed heads.
  tabs() {
    const { left, top, wide, high } = this;
    const [x, y] = [TAB.wide / 2 + 3, TAB.high / 2 + 3];
    if (this.data.axis === 'y') return [[left + wide / 2, top + high - y], [left + wide / 2, top + y]];
    return [[left + x, top + high / 2], [left + wide - x, top + high / 2]];
  }

  drawTab([x, y], head) {
    const pen = this.canvas.getContext('2d');
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
    this.hearFirst({ pointerdown: this.down, pointermove: this.move, pointerup: this.up,
      pointercancel: this.abandon });
    this.canvas.addEventListener('keydown', (event) => this.typed(event));
    // a finger on a handle does not scroll the page
    this.canvas.addEventListener('touchstart', (event) => this.gesture && event.preventDefault(), { passive: false });
  }

  // Return what a pointer grips: {end} of a head, or {off}, the distance in pixels from the well.
  gripped(event) {
    const [x, y] = this.spotOf(event), { well, heads } = this.chosen;
    const reach = event.pointerType === 'touch' ? FINGER_GRIP : GRIP;
    const end = heads ? this.tabs().findIndex(([tx, ty]) => (
      Math.abs(x - tx) <= TAB.wide / 2 && Math.abs(y - ty) <= Math.max(TAB.high / 2, reach))) : -1;
    if (end >= 0) return { end };
    if (!well) return null;
    const [wx, wy] = this.toCanvas(well[1] + 0.5, well[0] + 0.5);
    return Math.hypot(x - wx, y - wy) <= reach ? { off: [wx - x, wy - y] } : null;
  }

  down(event) {
    if (this.gesture || this.pointers.size) return this.abandon(); // a second finger zooms
    const held = event.button === 0 && this.gripped(event);
    if (!held) return false;
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    this.gesture = { id: event.pointerId, from: this.spotOf(event), heads: this.chosen.heads, ...held };
    return true;
  }

  move(event) {
    const { gesture } = this;
    this.canvas.classList.toggle('moves', Boolean(gesture || this.gripped(event)));
    if (gesture?.id !== event.pointerId) return false;
    const [x, y] = this.spotOf(event);
    if (gesture.off) {
      const [column, row] = this.toCells(x + gesture.off[0], y + gesture.off[1]);
      this.place([Math.floor(row), Math.floor(column)]);
      this.point(this.chosen.well);
    } else this.lift(gesture, Math.round((gesture.from[1] - y) / STEP));
    return true;
  }

  up(event) {
    if (this.gesture?.id !== event.pointerId) return false;
    this.abandon();
    return true;
  }

  abandon() {
    this.gesture = null;
    return false;
  }

  pick(row, column) { this.place([row, column]); }

  // Place the well in a cell unless nothing can flow there.
  place(cell) {
    const conducts = this.data.labels[this.indexAt(cell)] !== undefined;
    if (conducts && !isSame(cell, this.chosen.well)) this.choose({ well: cell });
  }

  // Raise the head of an end by steps of about a tenth of the difference; equal heads are left out.
  lift({ end, heads }, steps) {
    const size = 10 ** Math.floor(Math.log10(Math.abs(heads[0] - heads[1]) / 5));
    const head = Number((heads[end] + steps * size).toPrecision(6));
    if (head !== heads[1 - end] && head !== this.chosen.heads[end]) this.choose({ heads: heads.with(end, head) });
  }

  // Arrow keys move the well, with Shift by ten cells.
  typed(event) {
    const way = WAYS[event.key];
    if (!way || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation(); // arrow keys also step through the realizations of a page
    const { nx, ny } = this.data, far = event.shiftKey ? 10 : 1;
    const [row, column] = this.chosen.well ?? [ny >> 1, nx >> 1];
    const within = (k, n) => Math.min(Math.max(k, 0), n - 1);
    this.place([within(row + far * way[0], ny), within(column + far * way[1], nx)]);
    this.point(this.chosen.well);
  }

  stop() {
    this.latest.rest();
    super.stop();
  }
}
