// A volume: three linked slices and the 3D view (body) with the same cursor, vertical exaggeration and data.
// This code is appended to drawing.js, edits.js, slice.js and body.js. Only edits are sent to the server.
const LINK = 'ccwsim-volume';
const GAP = 24, TWO_COLUMNS = 600, THREE_COLUMNS = 660; // gap, and minimum widths of two and three columns, in pixels
const BESIDE = 420, BESIDE_GAP = 16, SHARE = 8 / 13; // minimum width, gap and share of a volume beside its slices
const ABOVE = 220; // pixels of a full screen that titles, sliders and legend take
const STEPS_UP = [1, 2, 3, 5, 10, 20, 50, 100, 200]; // choices of the vertical exaggeration
const LOWEST = 0.2, HIGHEST = 1.5; // limits of a section's height, as shares of the longer horizontal side
const USUAL = { link: '', name: 'volume', body: true, max_height: 480, picks: false, fits: false }; // options, by default
const LINES = 28, LINES_GAP = 4, SMALLEST_CELL = 0.25; // in pixels: title with slider of a slice, gap between slices, cell
const CACHED = 8; // number of unpacked volumes in memory
// State of several or of removed components, stored in the window because each component has a copy of this
// module.
const page = (window[Symbol.for(LINK)] ??= { cells: new Map(), shared: new Map(), local: new Map() });

class VolumeView extends View {
  constructor(root) {
    super(root);
    this.page = page;
    this.outbox = new EditQueue((edits) => this.report('edits', edits));
    this.slices = ['z', 'y', 'x'].map((axis) => new Slice(this, axis));
    this.body = new Body(this);
    this.listen();
  }

  // The old volume stays on the screen until the cells of the new volume are unpacked.
  async show(options) {
    const data = { ...USUAL, ...options };
    this.start();
    this.latest = data;
    this.outbox.taken(data.ack ?? 0);
    const cells = await unpackedOnce(data);
    if (this.latest !== data) return;
    Object.assign(this, { data, cells });
    this.local = stateOf(page.local, data.key);
    this.shared = stateOf(page.shared, data.link || data.key);
    if (data.cursor && String(data.cursor) !== this.shared.sent) {
      this.shared.at = data.cursor;
      this.shared.sent = String(data.cursor);
    }
    this.palette = paletteOf(data.lut);
    this.findWells();
    this.body.show();
    this.legendOf();
    this.layout();
  }

  // Return the cursor, at first in the middle; a volume of another size with the same cursor uses the nearest cell.
  get at() { return this.data.shape.map((n, axis) => Math.min(this.shared.at?.[axis] ?? n >> 1, n - 1)); }

  get exaggeration() { return this.shared.exaggeration ?? this.usual; }

  // Find the named wells, which may deviate, and the columns of cells with several data outside these wells.
  findWells() {
    const { points, shape } = this.data;
    this.facies = new Map(points.map((point) => [this.idOf(point), point[3]]));
    const named = wellsWithData(this.data, (cell) => this.idOf(cell));
    const taken = new Set(named.flatMap(({ cells }) => cells.map((cell) => this.idOf(cell))));
    const columns = new Map();
    for (const point of points) {
      const id = point[1] * shape[0] + point[2];
      if (!taken.has(this.idOf(point))) columns.set(id, [...columns.get(id) ?? [], point]);
    }
    const unnamed = [...columns.values()].map((cells) => ({ name: '', cells })).filter(({ cells }) => cells.length > 1);
    this.wells = [...named, ...unnamed];
    this.wellOf = new Map();
    for (const well of this.wells) {
      well.top = well.cells.reduce((one, other) => (other[0] > one[0] ? other : one));
      for (const cell of well.cells) this.wellOf.set(this.idOf(cell), well);
    }
  }

  idOf([layer, row, column]) { return (layer * this.data.shape[1] + row) * this.data.shape[0] + column; }

  // Return the colour of the datum in a cell.
  colourOf(cell) { return (this.data.point_lut || this.data.lut)[this.facies.get(this.idOf(cell))]; }

  wellAt(cell) { return this.wellOf.get(this.idOf(cell)); }

  // Offer the vertical exaggerations at which sections are readable and not too high.
  offerExaggerations() {
    const [x, y, z] = this.data.shape.map((n, axis) => n * this.data.cell_size[axis]);
    const share = z / Math.max(x, y);
    this.usual = STEPS_UP.find((step) => step * share >= LOWEST) ?? STEPS_UP.at(-1);
    const offered = STEPS_UP.filter((step) => step === 1 || step <= this.usual || step * share <= HIGHEST);
    if (!offered.includes(this.exaggeration)) offered.push(this.exaggeration);
    const list = this.root.querySelector('.exaggeration');
    list.replaceChildren(...offered.map((step) => new Option(`×${step}`, step)));
    list.value = this.exaggeration;
  }

  // The height that the page leaves for slices, or 0 if the height of a volume follows from its width.
  get room() { return (this.data.fits && parseFloat(getComputedStyle(this.root).scrollMarginTop)) || 0; }

  // Show the body, the slices, or both, which a volume with a given height cannot.
  choosePanels() {
    const { data, root, shared, slices, body } = this, either = this.room > 0;
    root.classList.toggle('row', either);
    body.panel.hidden = !data.body || (either && !shared.body);
    for (const slice of slices) slice.panel.hidden = either && Boolean(shared.body);
    const tool = root.querySelector('[data-do="body"]');
    tool.hidden = !either || !data.body;
    tool.setAttribute('aria-pressed', Boolean(shared.body));
  }

  layout() {
    const { data, root } = this;
    this.offerExaggerations();
    this.choosePanels();
    const whole = Math.floor(root.getBoundingClientRect().width);
    if (!whole) return;
    if (this.room) return this.layoutRow(whole);
    const columns = data.body ? (whole >= TWO_COLUMNS ? 2 : 1) : whole >= THREE_COLUMNS ? 3 : 1;
    const beside = data.body && columns === 1 && whole >= BESIDE;
    for (const [name, is] of Object.entries({ two: columns === 2, three: columns === 3, beside })) {
      root.classList.toggle(name, is);
    }
    const inRow = Math.floor((whole - GAP * (columns - 1)) / columns);
    const wide = beside ? Math.floor((whole - BESIDE_GAP) * (1 - SHARE)) : inRow;
    const most = root.matches(':fullscreen') ? Math.max(data.max_height, window.innerHeight - ABOVE) / (columns === 2 ? 2 : 1) : data.max_height;
    const { left, bottom, dots } = this.margins();
    const [x, y, z] = data.shape.map((n, axis) => n * data.cell_size[axis]);
    const pixels = Math.min((wide - left - 1) / Math.max(x, y), most / y, most / z);
    this.scale = data.cell_size.map((size, axis) => size * pixels * (axis === 2 ? this.exaggeration : 1));
    for (const slice of this.slices) slice.layout(left, bottom, dots);
    const map = this.slices[0].high + 1 + bottom;
    const bodyWide = beside ? Math.floor((whole - BESIDE_GAP) * SHARE) : inRow;
    const high = columns === 2 ? Math.max(map, Math.min(0.62 * wide, most)) : (beside ? 1.1 : 0.75) * bodyWide;
    this.body.layout(bodyWide, Math.min(high, Math.max(most, map)), dots);
    this.ask('all');
  }

  // Lay out the map beside two sections below each other, or the body, in a given height.
  layoutRow(whole) {
    const { data, room, slices } = this;
    for (const name of ['two', 'three', 'beside']) this.root.classList.remove(name);
    const { left, bottom, dots } = this.margins();
    const [x, y, z] = data.shape.map((n, axis) => n * data.cell_size[axis]);
    const wide = (whole - BESIDE_GAP) / (x + Math.max(x, y)), margin = 2 * (left + 1) / (x + Math.max(x, y));
    const high = [(room - LINES - bottom - 1) / y, ((room - LINES_GAP) / 2 - LINES - bottom - 1) / (z * this.exaggeration)];
    const pixels = Math.max(Math.min(wide - margin, ...high), SMALLEST_CELL);
    this.scale = data.cell_size.map((size, axis) => size * pixels * (axis === 2 ? this.exaggeration : 1));
    for (const slice of slices) slice.layout(left, bottom, dots);
    this.body.layout(whole, room - 2 * LINES, dots);
    this.ask('all');
  }

  // Return the margins of slices for coordinates, and the number of dots in a pixel.
  margins() {
    const { data, root } = this;
    const left = data.axes ? roomForNumbers(this.slices[0].canvas, root, [this.extent(1), this.extent(2)]) : 1;
    return { left, bottom: data.axes ? 20 : 1, dots: window.devicePixelRatio || 1 };
  }

  // Return the coordinates of the two ends of an axis.
  extent(axis) {
    const { origin, cell_size: size, shape } = this.data;
    return [origin[axis], origin[axis] + shape[axis] * size[axis]];
  }

  centre(axis) {
    const { origin, cell_size: size } = this.data;
    return String(+(origin[axis] + (this.at[axis] + 0.5) * size[axis]).toPrecision(9));
  }

  // Draw at the next frame, once for all calls before this frame.
  ask(what, moving = false) {
    this.wanted = { slices: what !== 'body' || this.wanted?.slices, body: what !== 'slices' || this.wanted?.body, moving };
    this.frame ??= requestAnimationFrame(() => {
      const { slices, body, moving: moves } = this.wanted;
      this.frame = this.wanted = null;
      const began = performance.now();
      if (slices && !this.slices[0].panel.hidden) this.slices.forEach((slice) => slice.draw());
      if (slices) this.took = performance.now() - began;
      if (body && !this.body.panel.hidden) this.body.draw(moves);
      this.root.dataset.took = `${this.took?.toFixed(1)} ${this.body.took?.toFixed(1) ?? ''}`;
    });
  }

  // Move the cursor in all volumes that share it.
  moveTo(at) {
    if (at.every((k, axis) => k === this.at[axis])) return;
    this.shared.at = at;
    this.tell('all');
  }

  // Store the cell under the pointer, or null.
  point(cell) {
    if (String(this.shared.hover) === String(cell)) return;
    this.shared.hover = cell;
    this.tell('slices');
  }

  tell(what) {
    window.dispatchEvent(new CustomEvent(LINK, { detail: { shared: this.shared, what } }));
  }

  // Write the coordinates and the label of the cell under the pointer.
  say() {
    const { hover } = this.shared;
    const { shape, labels } = this.data;
    const inside = hover && hover.every((k, axis) => k < shape[axis]);
    const [x, y, z] = inside ? hover : [];
    const well = inside && this.wellAt([z, y, x])?.name;
    this.readout.textContent = inside
      ? `(${x}, ${y}, ${z}) ${labels[this.cells[this.idOf([z, y, x])]] ?? 'inactive'}${well ? ` · ${well}` : ''}` : '';
  }

  // Send cells (x, y, z) in a slice across an axis, or an undo or redo, to the page.
  pick(axis, cells) { this.outbox.push({ axis, cells: cells.map(([x, y, z]) => [z, y, x]) }); }

  step(what) { this.outbox.push({ do: what }); }

  canStep(what) {
    const { picks, can_undo: undo, can_redo: redo } = this.latest;
    return picks && ((what === 'undo' ? undo : redo) || this.outbox.edits.length > 0);
  }

  save() {
    const box = this.root.querySelector('.panels').getBoundingClientRect();
    const dots = window.devicePixelRatio || 1;
    const picture = document.createElement('canvas');
    sizeCanvas(picture, box.width, box.height, dots);
    const pen = picture.getContext('2d');
    pen.scale(dots, dots);
    pen.fillStyle = styleOf(this.root, '--st-background-color') || PAPER;
    pen.fillRect(0, 0, box.width, box.height);
    pen.fillStyle = styleOf(this.root, '--st-text-color');
    pen.font = '13px ' + styleOf(this.root, '--st-font');
    pen.textBaseline = 'middle';
    for (const panel of this.root.querySelectorAll('.panel')) {
      const canvas = panel.querySelector('canvas'), place = canvas.getBoundingClientRect();
      if (!place.width) continue;
      const title = panel.querySelector('.title'), above = title.getBoundingClientRect();
      const words = [...title.children].map((part) => part.selectedOptions?.[0].text ?? part.textContent);
      pen.fillText(words.join('  '), above.left - box.left, above.top - box.top + above.height / 2);
      pen.drawImage(canvas, place.left - box.left, place.top - box.top, place.width, place.height);
    }
    download(`${this.data.name}.png`, picture.toDataURL('image/png'));
  }

  listen() {
    const { root } = this;
    root.querySelector('.exaggeration').addEventListener('change', (event) => {
      this.shared.exaggeration = +event.target.value;
      this.tell('size');
    });
  }

  act(what) {
    if (what === 'body') {
      this.shared.body = !this.shared.body;
      this.tell('size');
    } else if (what === 'full') toggleFullScreen(this.root);
    else super.act(what);
  }

  draw() { this.ask('all'); }

  // Follow a change of the part `what` in another view with the same cursor.
  follow({ shared, what }) {
    if (!this.data || shared !== this.shared) return;
    this.say();
    if (what === 'size') this.layout();
    else if (what === 'mode') this.body.show();
    else this.body.follow();
    const isCut = what === 'all' && this.body.isBlock;
    if (what === 'look' || what === 'mode') this.ask('body', what === 'look');
    else if (what !== 'size') this.ask(isCut ? 'all' : 'slices', true);
  }

  heardByWindow() {
    return {
      [LINK]: ({ detail }) => this.follow(detail),
      keydown: (event) => this.typedStep(event),
      resize: () => this.data?.fits && this.layout(),
    };
  }
}

function stateOf(states, key) {
  if (!states.has(key)) states.set(key, {});
  return states.get(key);
}

// Return the cells of a volume; each volume is unpacked only once.
function unpackedOnce({ cells: packed, digest }) {
  const cells = page.cells.get(digest) ?? unpacked(packed);
  page.cells.delete(digest);
  page.cells.set(digest, cells);
  if (page.cells.size > CACHED) page.cells.delete(page.cells.keys().next().value);
  return cells;
}

export default drawnBy(VolumeView, '.volume');
