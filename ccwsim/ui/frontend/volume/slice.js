// A slice through a volume on a canvas: cells, data, wells, cross hairs. Axes 0, 1, 2 are x, y, z. A slice is
// perpendicular to one axis; `right` and `up` are the axes along its edges, with z upwards.
const PLANES = {
  x: { across: 0, right: 1, up: 2, called: 'column' },
  y: { across: 1, right: 0, up: 2, called: 'row' },
  z: { across: 2, right: 0, up: 1, called: 'layer' },
};
const WELL_REACH = 0.05; // maximum distance of a well from a layer, as a share of the number of layers
const NOTCH = 40; // wheel movement in pixels for a step of one slice
const KEYS = { ArrowUp: 1, ArrowRight: 1, ArrowDown: -1, ArrowLeft: -1, PageUp: 10, PageDown: -10,
  Home: -Infinity, End: Infinity };

class Slice {
  constructor(view, axis) {
    Object.assign(this, PLANES[axis], { view, axis, root: view.root });
    this.panel = view.root.querySelector(`[data-panel="${axis}"]`);
    this.canvas = this.panel.querySelector('canvas');
    this.slider = this.panel.querySelector('input');
    this.wheeled = 0;
    this.listen();
  }

  get index() { return this.view.at[this.across]; }

  get count() { return this.view.data.shape[this.across]; }

  layout(left, bottom, dots) {
    const { data: { shape }, scale } = this.view;
    const [wide, high] = [this.right, this.up].map((axis) => shape[axis] * scale[axis]);
    Object.assign(this, { left, top: 1, wide, high, dots });
    sizeCanvas(this.canvas, wide + left + 1, high + 1 + bottom, dots);
    this.slider.max = this.count - 1;
    this.slider.parentElement.style.width = wide + left + 1 + 'px';
  }

  draw() {
    const { view } = this, { data } = view;
    const axes = data.axes ? [view.extent(this.right), view.extent(this.up)] : [];
    drawFramed(this.canvas, this, (pen) => this.drawInside(pen), ...axes);
    this.say();
  }

  drawInside(pen) {
    const { view } = this, { hover } = view.shared;
    pen.imageSmoothingEnabled = Math.min(view.scale[this.right], view.scale[this.up]) * this.dots < 1;
    pen.drawImage(this.picture(), this.left, this.top, this.wide, this.high);
    this.drawLines(pen);
    this.drawHairs(pen);
    if (view.shows.data) this.drawData(pen);
    if (hover?.[this.across] !== this.index) return;
    drawCrossAt(pen, ...this.toCanvas(hover[this.right] + 0.5, hover[this.up] + 0.5));
  }

  // Draw the cells of the slice, one pixel per cell.
  picture() {
    const { data: { shape }, cells, palette } = this.view;
    const [wide, high] = [shape[this.right], shape[this.up]];
    const strides = [1, shape[0], shape[0] * shape[1]];
    const [along, upwards] = [strides[this.right], strides[this.up]];
    return pictureOf(wide, high, (pixels) => {
      for (let j = 0; j < high; j++) {
        let from = this.index * strides[this.across] + (high - 1 - j) * upwards;
        for (let k = j * wide; k < (j + 1) * wide; k++, from += along) pixels[k] = palette[cells[from]];
      }
    });
  }

  // Draw the parts of lines that are in the slice.
  drawLines(pen) {
    const { lines = [], line_lut: lut } = this.view.data;
    const [across, right, up] = [this.across, this.right, this.up].map((axis) => 2 - axis);
    const inside = (point) => Math.floor(point[across]) === this.index;
    const place = (point) => this.toCanvas(point[right], point[up]);
    for (const line of lines) {
      for (let k = 1; k < line.length; k++) {
        const [from, to] = [line[k - 1], line[k]];
        if (!inside(from) && !inside(to)) continue;
        strokeIn(pen, [[INK, 3, 0.7], [lut[to.at(-1)], 1.6]], () => {
          pen.moveTo(...place(from));
          pen.lineTo(...place(to));
        });
      }
    }
  }

  // Draw the lines in which the other two slices cut this slice.
  drawHairs(pen) {
    const { at } = this.view;
    const [x, y] = this.toCanvas(at[this.right] + 0.5, at[this.up] + 0.5);
    drawCrossAt(pen, x, y, 7, [this.wide + 7, this.high + 7], [[PAPER, 3, 0.55], [INK, 1, 0.85]]);
  }

  // Draw data in the slice as circles; in a section, draw data of a well as a strip of cells. In the map, a
  // well with data near the layer, but none in the layer, is a dot. The name of a well is at its highest datum.
  drawData(pen) {
    const { view, index } = this, wrongColour = styleOf(view.root, '--st-red-color');
    const { data, wells } = view;
    const colours = data.point_lut || data.lut;
    const inside = data.points.filter((point) => point[2 - this.across] === index);
    const radius = markRadius(this, inside.length);
    const circles = [], strips = [], heads = new Map();
    for (const point of inside) {
      const well = view.wellAt(point), strip = this.axis !== 'z' && well;
      const [x, y] = this.toCanvas(point[2 - this.right] + 0.5, point[2 - this.up] + 0.5);
      if (well && !(heads.get(well)?.[1] <= y)) heads.set(well, [x, y]);
      (strip ? strips : circles).push({ x, y, radius, colour: colours[point[3]], wrong: point[4] });
    }
    const high = this.view.scale[this.up], half = Math.max(2.5, this.view.scale[this.right] / 2);
    const box = (_, { x, y }, rings, colour) => { // integer pixels avoid gaps between the cells of a well
      const ring = RING * rings, top = Math.round(y - high / 2) - ring, base = Math.round(y + high / 2) + ring;
      pen.fillStyle = colour;
      pen.fillRect(x - half - ring, top, 2 * (half + ring), base - top);
    };
    drawData(pen, strips, wrongColour, box);
    if (this.axis === 'z') {
      const reach = Math.max(1, Math.round(WELL_REACH * data.shape[2]));
      for (const well of wells) {
        if (heads.has(well)) continue;
        const off = ([layer]) => Math.abs(layer - index);
        const near = well.cells.reduce((one, other) => (off(other) < off(one) ? other : one));
        if (off(near) > reach) continue;
        const [px, py] = this.toCanvas(near[2] + 0.5, near[1] + 0.5);
        heads.set(well, [px, py]);
        disc(pen, px, py, 2.4, PAPER);
        disc(pen, px, py, 1.4, INK);
      }
    }
    drawData(pen, circles, wrongColour);
    const named = [...heads].filter(([{ name }]) => name);
    const names = named.map(([{ name }, spot]) => [name, ...spot]);
    drawNames(pen, this, names, data.max_names);
  }

  say() {
    const { data, at } = this.view;
    const place = this.view.centre(this.across);
    this.panel.querySelector('.where').textContent = `${this.called} ${this.index}`;
    this.panel.querySelector('output').textContent = data.axes ? place : this.index;
    this.canvas.setAttribute('aria-label', `${data.alt}, ${this.called} ${this.index}`);
    this.slider.value = at[this.across];
    this.slider.setAttribute('aria-valuetext', `${this.called} ${this.index}`);
  }

  toCanvas(right, up) {
    const { scale } = this.view;
    return [this.left + right * scale[this.right], this.top + this.high - up * scale[this.up]];
  }

  // Return the cell (x, y, z) at a pointer; the nearest cell for a pointer outside the slice.
  cellAt(event) {
    const { at, scale, data: { shape } } = this.view;
    const box = this.canvas.getBoundingClientRect();
    const shrunk = box.width / parseFloat(this.canvas.style.width) || 1;
    const cell = [...at];
    const place = { [this.right]: ((event.clientX - box.left) / shrunk - this.left) / scale[this.right],
      [this.up]: (this.top + this.high - (event.clientY - box.top) / shrunk) / scale[this.up] };
    for (const axis of [this.right, this.up]) {
      cell[axis] = clamp(Math.floor(place[axis]), 0, shape[axis] - 1);
    }
    const beside = [this.right, this.up].some((axis) => place[axis] < 0 || place[axis] >= shape[axis]);
    return { cell, beside };
  }

  step(by) {
    const at = [...this.view.at];
    at[this.across] = clamp(at[this.across] + by, 0, this.count - 1);
    this.view.moveTo(at);
  }

  listen() {
    const { canvas, view } = this;
    this.slider.addEventListener('input', () => this.step(+this.slider.value - this.index));
    hearWheel(canvas, (event) => {
      this.wheeled += event.deltaMode ? NOTCH * Math.sign(event.deltaY) : event.deltaY;
      if (!view.cells || Math.abs(this.wheeled) < NOTCH) return;
      this.step(-Math.sign(this.wheeled));
      this.wheeled = 0;
    });
    hearKeys(canvas, ({ key }) => {
      if (view.cells && view.data.picks && key === 'Enter') view.pick(this.axis, [view.at]);
      if (view.cells && KEYS[key]) this.step(KEYS[key]);
      return KEYS[key];
    });
    hear(canvas, {
      pointerdown: (event) => {
        if (!view.cells || event.button) return;
        canvas.focus();
        this.pressed = true;
        if (event.pointerType === 'mouse') this.press(event);
        const { cell, beside } = this.cellAt(event);
        this.stroke = view.data.picks && !beside ? [cell] : null;
        canvas.setPointerCapture(event.pointerId);
      },
      pointermove: (event) => {
        if (!view.cells) return;
        const { cell, beside } = this.cellAt(event);
        view.point(beside ? null : cell);
        if (!this.pressed) return;
        view.moveTo(cell);
        if (this.stroke && !beside) this.stroke.push(...cellsBetween(this.stroke.at(-1), cell).slice(1));
      },
      pointerup: (event) => {
        if (!this.pressed) return;
        this.press(event);
        if (this.stroke) view.pick(this.axis, this.stroke);
        this.pressed = this.stroke = null;
      },
      pointercancel: () => { this.pressed = this.stroke = null; },
      pointerleave: () => view.cells && view.point(null),
    });
  }

  press(event) { this.view.moveTo(this.cellAt(event).cell); }
}
