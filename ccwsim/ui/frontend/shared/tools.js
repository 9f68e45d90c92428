// A map with tools. A pressed pointer grips an object and makes a gesture; arrow keys move a cursor. A component
// defines the grip, the steps and the end of a gesture (`grip`, `follow`, `finish`), and other keys (`typedKey`).
// This code is appended to map.js and edits.js.
const STEPS = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
const FAST = 10; // number of cells of a step with Shift
const SLOP = 4, FINGER_SLOP = 8; // maximum movement in pixels of a click; longer movements are drags

class ToolMap extends CellMap {
  tool = 'pan';
  gesture = null; // a pressed pointer, and the object that it grips
  spot = null; // place of the pointer or cursor

  // Move the toolbar, which is separate from the map's HTML, into the map.
  constructor(root) {
    const bar = root.parentNode.querySelector('.bar');
    if (bar) root.append(bar);
    super(root);
  }

  show(data) {
    this.canvas.setAttribute('role', 'application');
    super.show(data);
    this.bars();
  }

  // Show in the toolbar which tool is chosen, and whether there is something to undo and to redo.
  bars() {
    for (const button of this.root.querySelectorAll('[data-tool]')) {
      button.setAttribute('aria-checked', button.dataset.tool === this.tool);
    }
    for (const button of this.root.querySelectorAll('[data-step]')) {
      button.disabled = !this.canStep(button.dataset.step);
    }
    this.canvas.classList.toggle('draws', this.tool !== 'pan');
  }

  listen() {
    super.listen();
    this.canvas.addEventListener('keydown', (event) => this.typedStep(event));
    hearKeys(this.canvas, (event) => this.typed(event));
    this.root.querySelector('.bar')?.addEventListener('click', (event) => {
      const { tool, step, ...choices } = event.target.closest('button')?.dataset || {};
      if (tool) this.tool = tool;
      if (step) this.step(step);
      this.press?.(choices);
      this.bars();
      this.draw();
    });
  }

  // A second finger zooms instead of drawing.
  pointerdown(event) {
    if (this.gesture) this.pointers.set(this.gesture.id, this.gesture.spot);
    if (this.pointers.size) this.abandon();
    const gripped = !this.pointers.size && event.button === 0 && this.grip(event);
    if (!gripped) return super.pointerdown(event);
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    const spot = this.spotOf(event);
    this.gesture = { id: event.pointerId, spot, start: spot, dragged: false, ...gripped };
    return this.draw();
  }

  pointermove(event) {
    this.spot = this.spotOf(event);
    const { gesture, spot } = this;
    this.canvas.classList.toggle('moves', Boolean((gesture ?? this.grip(event))?.moves));
    if (gesture?.id !== event.pointerId) return super.pointermove(event);
    gesture.spot = spot;
    gesture.dragged ||= spread(spot, gesture.start) >= (event.pointerType === 'touch' ? FINGER_SLOP : SLOP);
    return this.follow(gesture, event);
  }

  pointerup(event) {
    const { gesture } = this;
    if (gesture?.id !== event.pointerId) return super.pointerup(event);
    this.abandon();
    return this.finish?.(gesture, event);
  }

  pointercancel(event) {
    this.abandon();
    super.pointercancel(event);
  }

  pointerleave() {
    this.spot = null;
    super.pointerleave();
  }

  // A double click zooms unless it draws.
  dblclick(event) { if (this.tool === 'pan') super.dblclick(event); }

  abandon() {
    this.gesture = null;
    this.draw();
  }

  // Return the nearest of some places on the canvas, its number and its distance.
  nearest([x, y], places) {
    let k = -1, far = Infinity;
    places.forEach((place, j) => {
      const away = Math.hypot(place[0] - x, place[1] - y);
      if (away < far) [k, far] = [j, away];
    });
    return { k, far };
  }

  inside([row, column]) { return row >= 0 && column >= 0 && row < this.data.ny && column < this.data.nx; }

  // Return whether a key is used; Escape is passed on, because it may also close a menu.
  typed({ key, shiftKey }) {
    if (key === 'Escape') this.abandon();
    if (!STEPS[key]) return this.typedKey(key);
    this.walk(STEPS[key].map((k) => k * (shiftKey ? FAST : 1)));
    return true;
  }

  get cursor() { return this.hover; }

  // Move the cursor by some cells, or begin in the middle of the view; the view follows.
  walk([up, right]) {
    const { data: { nx, ny }, view, cursor } = this;
    const [row, column] = cursor ? [cursor[0] + up, cursor[1] + right] : [Math.floor(view.y), Math.floor(view.x)];
    const cell = [clamp(row, 0, ny - 1), clamp(column, 0, nx - 1)];
    const near = (middle, k, half) => clamp(middle, k + 1 - half, k + half);
    this.look({ ...view, x: near(view.x, cell[1], nx / 2 / view.zoom), y: near(view.y, cell[0], ny / 2 / view.zoom) });
    this.spot = this.toCanvas(cell[1] + 0.5, cell[0] + 0.5);
    this.readout.setAttribute('aria-live', 'polite');
    this.walkedTo(cell);
  }

  walkedTo(cell) { this.point(cell); }
}
