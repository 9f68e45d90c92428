// A map of square cells on a canvas: nearest neighbour, linked zoom, hover, data as ringed circles. Cells are
// [row from the south, column]; their values are indices into `lut` and `labels`.
const LINK = 'ccwsim-map';
const HIGHEST_MAP = 620; // maximum height of a map in pixels, by default
const ABOVE_FULL = 88, FULL_MARGIN = 48; // height of the line below a map in full screen, and its margins, in pixels
const SCALE_BARS = [1, 2, 5], SCALE_BAR = 0.25; // leading digits, and maximum length as a share of the width of a map
const NARROW = 280; // minimum width in pixels of the line below a map
const POINTED = ['pointerdown', 'pointermove', 'pointerup', 'pointercancel', 'pointerleave', 'dblclick'];
const ZOOMED = 8; // number of cells along an edge of a strongly zoomed map
// Maps that share zoom and scale, stored in the window because each component has a copy of this module.
const groups = (window[Symbol.for(LINK)] ??= new Map());

class CellMap extends View {
  constructor(root) {
    super(root);
    this.canvas = root.querySelector('canvas');
    this.below = root.querySelector('.below');
    this.pointers = new Map();
    this.view = this.hover = null;
    this.listen();
  }

  show(data) {
    const sameGrid = this.data && this.data.nx === data.nx && this.data.ny === data.ny;
    this.start();
    this.leave();
    if (!sameGrid) this.before = null;
    else if (this.shown && data.answer !== this.data.answer) this.before = { ...this.shown, alt: this.data.alt };
    this.data = data;
    if (data.scale) groups.set(data.scale, (groups.get(data.scale) || new Set()).add(this));
    if (!sameGrid || !this.view) this.view = { x: data.nx / 2, y: data.ny / 2, zoom: 1 };
    this.canvas.setAttribute('aria-label', data.alt);
    this.root.querySelector('[data-do="before"]').hidden = !this.before;
    this.root.querySelector('.tools').hidden = data.tools === false;
    this.legendOf();
    this.ask(data.digest + data.lut.join());
    this.layout();
  }

  // The old picture stays until the cells of the new picture are unpacked.
  async ask(wanted) {
    if (this.wanted === wanted) return;
    this.wanted = wanted;
    const { nx, ny, lut } = this.data;
    const indices = await unpacked(this.data.cells), palette = paletteOf(lut);
    if (this.wanted !== wanted) return;
    const picture = pictureOf(nx, ny, (pixels) => {
      indices.forEach((index, k) => { pixels[(ny - 1 - Math.floor(k / nx)) * nx + (k % nx)] = palette[index]; });
    });
    this.shown = { picture, indices };
    this.pictureKey = wanted;
    this.say();
    this.layout();
  }

  // Show the picture before the last change of the study while a key or a button is held.
  holdBefore(held, tell = true) {
    if (held === this.held) return;
    this.held = held;
    this.say();
    this.draw();
    if (tell) this.tell();
  }

  get pictured() { return (this.held && this.before) || this.shown; }

  layout() {
    const { nx, ny, axes, cell_size: [, size], origin: [, south], max_height: usual = HIGHEST_MAP } = this.data;
    const most = this.isFull ? window.innerHeight - ABOVE_FULL : usual;
    const north = south + ny * size;
    const margin = this.isFull ? FULL_MARGIN : 0;
    const wide = Math.floor(this.root.getBoundingClientRect().width) - margin;  // clientWidth may round up
    if (!wide) return;
    // the numbers of zoomed maps have more decimals
    const room = roomForNumbers(this.canvas, this.root, [[south, north], [north - ZOOMED * size, north]]);
    const [left, bottom] = axes ? [room, 20] : [1, 1];
    Object.assign(this, { left, bottom, top: 1, right: 1 });
    this.room = Math.min((wide - left - 1) / nx, most / ny);
    this.fit(true);
    if (this.leads) this.peers.forEach((map) => map.fit());
  }

  // Return all maps with the same scale.
  get peers() { return [...groups.get(this.data.scale) ?? []]; }

  get leads() { return this.room && this.data.leads !== false && !this.isFull; }

  get isFull() { return this.root.matches(':fullscreen'); }

  // Use the largest cells with which each leading map fits; draw the map if their size has changed or if `always`.
  fit(always = false) {
    const cell = this.isFull ? this.room : Math.min(this.room, ...this.peers.filter((map) => map.leads).map((map) => map.room));
    if (always || (this.room && Math.abs(cell - this.cell) > 1e-6)) this.size(cell);
  }

  leave() { groups.get(this.data?.scale)?.delete(this); }

  size(cell) {
    const { nx, ny } = this.data;
    Object.assign(this, { cell, wide: cell * nx, high: cell * ny, dots: window.devicePixelRatio || 1 });
    const [wide, high] = [this.wide + this.left + this.right, this.high + this.top + this.bottom];
    sizeCanvas(this.canvas, wide, high, this.dots);
    // below a map with coordinates, the cells begin at the same pixel
    const west = (map) => map.root.getBoundingClientRect().left;
    const above = this.peers.find((map) => map.data.axes && west(map) === west(this));
    const margin = above && this.leads && !this.data.axes ? above.left - this.left : 0;
    this.canvas.style.marginLeft = `${margin}px`;
    this.below.style.maxWidth = `${Math.max(wide + margin, NARROW)}px`;
    this.draw();
  }

  // Return the size of a cell in pixels.
  get pixels() { return this.cell * this.view.zoom; }

  // Convert a position in cells (x from the west, y from the south) to the canvas, and back.
  toCanvas(x, y) {
    return [this.left + this.wide / 2 + (x - this.view.x) * this.pixels,
      this.top + this.high / 2 - (y - this.view.y) * this.pixels];
  }

  toCells(px, py) {
    return [this.view.x + (px - this.left - this.wide / 2) / this.pixels,
      this.view.y - (py - this.top - this.high / 2) / this.pixels];
  }

  draw() {
    const { axes, cell_size: size, origin } = this.data;
    const [west, south] = this.toCells(this.left, this.top + this.high);
    const [east, north] = this.toCells(this.left + this.wide, this.top);
    const ends = (axis, low, high) => [origin[axis] + low * size[axis], origin[axis] + high * size[axis]];
    const inside = (pen) => this.drawInside(pen);
    drawFramed(this.canvas, this, inside, axes && ends(0, west, east), ends(1, south, north));
  }

  drawInside(pen) {
    if (this.pictured) {
      const { data: { nx, ny }, pixels } = this;
      pen.imageSmoothingEnabled = pixels * this.dots < 1;
      pen.imageSmoothingQuality = 'high';
      pen.drawImage(this.pictured.picture, ...this.toCanvas(0, ny), nx * pixels, ny * pixels);
    }
    this.drawLines(pen);
    this.drawTrail(pen);
    this.drawMarks(pen);
    if (this.shows.data) this.drawPoints(pen);
    this.drawCross(pen);
    if (this.isFull || this.view.zoom > 1) this.drawScaleBar(pen);
    if (this.held && this.before) drawName(pen, `before: ${this.before.alt}`, this.left + this.wide / 2, 0);
  }

  // Return the distance in cells from each datum to the second nearest datum, limited to the distance at
  // which marks no longer touch. The second nearest datum distinguishes rows of data from two close data.
  spacings() {
    const { points, nx } = this.data;
    if (this.spaced?.of === points && this.spaced.cell === this.cell) return this.spaced.each;
    const taken = new Set(points.map(([row, column]) => row * nx + column));
    const farthest = Math.ceil(2 * (MARK + 2 * RING) / this.cell);
    const hasDatum = (row, column) => column >= 0 && column < nx && taken.has(row * nx + column);
    const each = points.map(([row, column]) => {
      let near = 0;
      for (let d = 1; d < farthest; d++) {
        for (let k = -d; k < d; k++) { // four sides of a square around the datum, each without one end
          near += hasDatum(row - d, column + k) + hasDatum(row + d, column - k)
            + hasDatum(row - k, column - d) + hasDatum(row + k, column + d);
          if (near > 1) return d;
        }
      }
      return farthest;
    });
    this.spaced = { of: points, cell: this.cell, each };
    return each;
  }

  get radius() {
    return markRadius(this, this.data.points.length) * Math.min(Math.sqrt(this.view.zoom), 2.5);
  }

  // Return the radius of a mark that extends, with rings, at most half way to the next datum.
  radiusOf(k) {
    const half = 0.5 * this.spacings()[k] * this.pixels;
    return Math.max(SMALLEST_MARK, Math.min(this.radius, half / 1.8));
  }

  drawPoints(pen) {
    const { points, lut, point_lut: pointLut, nx, ny } = this.data;
    if (!points.length) return;
    const marks = [];
    points.forEach(([row, column, index, wrong], k) => {
      if (row >= ny || column >= nx) return;
      const [x, y] = this.toCanvas(column + 0.5, row + 0.5);
      if (x < -9 || y < -9 || x > this.wide + this.left + 9 || y > this.high + 9) return;
      const radius = this.radiusOf(k);
      marks.push({ x, y, radius, colour: (pointLut || lut)[index], wrong });
    });
    drawData(pen, marks, styleOf(this.root, '--st-red-color'));
    this.drawWells(pen);
  }

  // Return the named wells with data; they are found once for the same data.
  namedWells() {
    const { data } = this, { points, nx } = data;
    if (this.named?.of === points) return this.named.wells;
    this.named = { of: points, wells: wellsWithData(data, ([row, column]) => row * nx + column) };
    return this.named.wells;
  }

  // Write the name of each well in view above its northernmost datum.
  drawWells(pen) {
    const heads = this.namedWells().map(({ name, cells }) => {
      const [row, column] = cells.reduce((one, other) => (other[0] > one[0] ? other : one));
      return [name, ...this.toCanvas(column + 0.5, row + 0.5)];
    });
    const [right, low] = [this.left + this.wide, this.top + this.high];
    const inView = heads.filter(([, x, y]) => x > this.left && x < right && y > this.top && y < low);
    drawNames(pen, this, inView, this.data.max_names);
  }

  drawTrail(pen) {
    const places = (this.data.trail || []).map(([row, column]) => this.toCanvas(column, row));
    if (places.length < 2) return;
    strokeIn(pen, [[PAPER, 3, 0.75], [INK, 1.25, 0.75]], () => arrow(pen, places, 8));
  }

  drawLines(pen) {
    const { lines = [], line_lut: lut } = this.data;
    for (const line of lines) {
      strokeIn(pen, [[PAPER, 2.5, 0.8], [lut[line[0].at(-1)], 1.2, 0.9]], () => (
        line.forEach(([row, column]) => pen.lineTo(...this.toCanvas(column, row)))));
    }
  }

  // Draw boxes around cells, and outlined rings, discs and crosses in the middle of cells.
  drawMarks(pen) {
    for (const mark of this.data.marks || []) {
      const [x, y] = this.toCanvas(mark.column, mark.row + mark.height);
      const [right, low] = this.toCanvas(mark.column + mark.width, mark.row);
      const [mx, my] = [(x + right) / 2, (y + low) / 2];
      strokeIn(pen, [[INK, 4.5], [PAPER, 3.25], [mark.colour, 2]], () => {
        if (mark.kind === 'box') pen.rect(x, y, right - x, low - y);
        if (mark.kind === 'ring') pen.arc(mx, my, 4.5, 0, 2 * Math.PI);
        if (mark.kind === 'disc') pen.arc(mx, my, 4, 0, 2 * Math.PI);
        if (mark.kind === 'cross') {
          pen.moveTo(mx - 4, my - 4); pen.lineTo(mx + 4, my + 4);
          pen.moveTo(mx - 4, my + 4); pen.lineTo(mx + 4, my - 4);
        }
      });
      pen.fillStyle = mark.colour;
      if (mark.kind === 'disc') pen.fill();
    }
  }

  // Return the label of the mark or the name of the well that is nearest to a cell; empty if none is near.
  marked([row, column]) {
    const reach = Math.max(0.5, 7 / this.pixels);
    let nearest = '', best = reach;
    const wells = this.namedWells().flatMap(({ name: label, cells }) => cells.map(([r, c]) => (
      { label, row: r, column: c, height: 1, width: 1 })));
    for (const mark of [...wells, ...this.data.marks || []]) {
      if (!mark.label || mark.kind === 'box') continue;
      const away = Math.max(Math.abs(row + 0.5 - mark.row - mark.height / 2),
        Math.abs(column + 0.5 - mark.column - mark.width / 2));
      if (away <= best) [nearest, best] = [mark.label, away];
    }
    return nearest;
  }

  // Draw a line of a round length in coordinates, at the lower left.
  drawScaleBar(pen) {
    const { cell_size: [size] } = this.data, pixels = this.pixels / size;
    const most = SCALE_BAR * this.wide / pixels, power = 10 ** Math.floor(Math.log10(most));
    const length = power * SCALE_BARS.findLast((digit) => digit * power <= 1.001 * most); // log10 is rounded
    const [x, y] = [this.left + 12, this.top + this.high - 10];
    strokeIn(pen, [[PAPER, 5], [INK, 2]], () => { pen.moveTo(x, y); pen.lineTo(x + length * pixels, y); });
    pen.font = fontOf(this.root);
    drawName(pen, this.isWorld ? `${+length.toPrecision(3)}` : `${length} cells`, x + length * pixels / 2, y + 2);
  }

  // Whether coordinates are not only numbers of cells.
  get isWorld() {
    const { cell_size: size, origin } = this.data;
    return size.some((side) => side !== 1) || origin.some(Boolean);
  }

  drawCross(pen) {
    if (!this.hover) return;
    drawCrossAt(pen, ...this.toCanvas(this.hover[1] + 0.5, this.hover[0] + 0.5));
  }

  // Return the index of a cell in the picture that is shown; undefined outside the map or without a picture.
  indexAt([row, column]) {
    const { nx, ny } = this.data;
    if (row < 0 || column < 0 || row >= ny || column >= nx) return undefined;
    return this.pictured?.indices[row * nx + column];
  }

  at(cell) {
    const index = cell && (this.pictureKey === this.wanted || this.held) ? this.indexAt(cell) : undefined;
    return index === undefined ? '' : this.data.labels[index] ?? 'inactive';
  }

  point(cell, tell = true) {
    this.hover = cell;
    this.say();
    this.draw();
    if (tell) this.tell();
  }

  // Point to a cell if it is in the map.
  pointTo(cell) { this.point(this.at(cell) ? cell : null); }

  // Write the coordinates and the label of the cell under the pointer.
  say() {
    const { hover: cell } = this;
    const label = this.at(cell);
    const mark = label ? this.marked(cell) : '';
    this.readout.textContent = label ? `${this.placeOf(cell)} ${label}${mark && ' · ' + mark}` : '';
    this.readout.classList.toggle('long', Boolean(mark));
  }

  // Return the column and row of a cell or, in world coordinates, also the coordinates of its centre.
  placeOf([row, column]) {
    const { cell_size: size, origin } = this.data;
    const centre = [column, row].map((k, axis) => +(origin[axis] + (k + 0.5) * size[axis]).toPrecision(9));
    return this.isWorld ? `(${centre.join(', ')}) row ${row}, column ${column}:` : `(${column}, ${row})`;
  }

  look(view, tell = true) {
    const zoom = clamp(view.zoom, 1, Math.max(1, 48 / this.cell));
    const halfX = this.data.nx / 2 / zoom, halfY = this.data.ny / 2 / zoom;
    this.view = {
      zoom,
      x: clamp(view.x, halfX, this.data.nx - halfX),
      y: clamp(view.y, halfY, this.data.ny - halfY),
    };
    this.canvas.classList.toggle('near', zoom > 1);
    this.draw();
    if (tell) this.tell();
  }

  tell() {
    const { view, hover, held, data: { link } } = this;
    const detail = { from: this, link, view, hover, held };
    if (link) window.dispatchEvent(new CustomEvent(LINK, { detail }));
  }

  zoomBy(factor, px = this.left + this.wide / 2, py = this.top + this.high / 2) {
    const [x, y] = this.toCells(px, py);
    const zoom = this.view.zoom * factor;
    const kept = Math.max(zoom, 1) / this.view.zoom;
    this.look({ zoom, x: x + (this.view.x - x) / kept, y: y + (this.view.y - y) / kept });
  }

  act(what) {
    if (what === 'full') toggleFullScreen(this.root);
    if (what === 'in') this.zoomBy(1.6);
    if (what === 'out') this.zoomBy(1 / 1.6);
    if (what === 'fit') this.look({ zoom: 1, x: 0, y: 0 });
    super.act(what);
  }

  save() { download(`${this.data.name ?? 'map'}.png`, this.canvas.toDataURL('image/png')); }

  // Return the position of a pointer on the canvas, and the cell at this position.
  spotOf(event) {
    const box = this.canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  cellOf(event) {
    const [x, y] = this.toCells(...this.spotOf(event));
    return [Math.floor(y), Math.floor(x)];
  }

  listen() {
    const { canvas } = this;
    const release = () => this.holdBefore(false);
    hearWheel(canvas, (event) => this.zoomBy(zoomOf(event), ...this.spotOf(event)));
    for (const kind of POINTED) canvas.addEventListener(kind, (event) => this[kind](event));
    hear(canvas, {
      keydown: (event) => {
        const what = { '+': 'in', '=': 'in', '-': 'out', 0: 'fit' }[event.key];
        if (what) this.act(what);
        if (event.key === 'b') this.holdBefore(true);
      },
      keyup: release,
      blur: release,
    });
    hear(this.root.querySelector('[data-do="before"]'), {
      pointerdown: () => this.holdBefore(true),
      keydown: ({ key }) => (key === ' ' || key === 'Enter') && this.holdBefore(true),
      pointerup: release,
      pointerleave: release,
      pointercancel: release,
      keyup: release,
      blur: release,
    });
  }

  pick(cell) { this.report('cell', cell); }

  // Return the listeners of the map while the map is on the page.
  heardByWindow() {
    return { [LINK]: ({ detail }) => {
      if (detail.from === this || !this.data || detail.link !== this.data.link) return;
      this.point(detail.hover, false);
      this.look(detail.view, false);
      this.holdBefore(detail.held, false);
    } };
  }

  pointerdown(event) {
    this.canvas.focus();
    this.pointers.set(event.pointerId, this.spotOf(event));
    this.moved = 0;
    if (this.view.zoom > 1) this.canvas.setPointerCapture(event.pointerId);
  }

  // A pointer points to a cell, a pressed pointer pans, and two pressed pointers zoom.
  pointermove(event) {
    const now = this.spotOf(event), before = this.pointers.get(event.pointerId);
    if (!before) return this.pointTo(this.cellOf(event));
    this.moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
    const other = otherOf(this.pointers, event);
    if (other) {
      this.zoomBy(spread(now, other) / spread(before, other), ...other);
    } else if (this.view.zoom > 1) {
      this.look({ ...this.view,
        x: this.view.x - (now[0] - before[0]) / this.pixels, y: this.view.y + (now[1] - before[1]) / this.pixels });
    }
    this.pointers.set(event.pointerId, now);
  }

  pointerup(event) {
    const cell = this.cellOf(event);
    if (this.data.picks && this.moved < 4 && this.at(cell)) this.pick(cell);
    this.pointercancel(event);
  }

  pointercancel(event) { this.pointers.delete(event.pointerId); }

  pointerleave() { this.point(null); }

  dblclick(event) { this.zoomBy(2, ...this.spotOf(event)); }

  stop() {
    this.leave();
    super.stop();
  }
}

export default drawnBy(CellMap, '.map');
