// Parts that maps and volumes share: legend, read-out and tools below, events from views with the same link, and
// wheel, fingers and keys. This code precedes the modules of maps and volumes.
class View {
  shows = { data: true, corrected: true }; // parts that the tools show or hide

  constructor(root) {
    this.root = root;
    this.legend = root.querySelector('.legend');
    this.readout = root.querySelector('.readout');
    this.stop = this.stop.bind(this);
    this.watch = new ResizeObserver(() => this.data && this.layout());
    root.querySelector('.tools').addEventListener('click', ({ target }) => this.data && this.act(target.dataset.do));
  }

  // Start to listen; a second call has no effect.
  start() {
    this.stopHearing ??= hear(window, this.heardByWindow());
    this.watch.observe(this.root);
  }

  // Remove the view; a second call has no effect.
  stop() {
    this.stopHearing?.();
    this.stopHearing = null;
    this.watch.disconnect();
    this.outbox?.rest();
  }

  // Undo or redo if the keys of these commands are pressed.
  typedStep(event) {
    const what = stepOf(event);
    if (!what || !this.canStep(what)) return;
    event.preventDefault();
    event.stopPropagation(); // the page also has an undo
    this.step(what);
  }

  legendOf() {
    this.root.querySelector('[data-do="data"]').hidden = !this.data.points.length;
    fillLegend(this.legend, this.data);
    this.say();
  }

  act(what) {
    if (what === 'save') this.save();
    if (!(what in this.shows)) return;
    this.shows[what] = !this.shows[what];
    this.root.querySelector(`[data-do="${what}"]`).setAttribute('aria-pressed', this.shows[what]);
    this.draw();
  }
}

function toggleFullScreen(root) {
  if (root.matches(':fullscreen')) document.exitFullscreen();
  else root.requestFullscreen();
}

// Return the cells of a map or volume in the order x, y, z, from the south-west corner of the bottom.
async function unpacked(packed) {
  const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
  const plain = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(plain).arrayBuffer());
}

// Call `turn` when the wheel turns above a canvas with the focus, or with Ctrl; otherwise the page scrolls.
function hearWheel(canvas, turn) {
  canvas.addEventListener('wheel', (event) => {
    if (!event.ctrlKey && canvas.getRootNode().activeElement !== canvas) return;
    event.preventDefault();
    turn(event);
  }, { passive: false });
}

// Call `typed` for keys without Ctrl, Alt or Meta; a key for which it returns true does nothing else.
function hearKeys(canvas, typed) {
  canvas.addEventListener('keydown', (event) => {
    if (event.altKey || event.ctrlKey || event.metaKey || !typed(event)) return;
    event.preventDefault();
    event.stopPropagation(); // arrow keys also step through the realizations of a page
  });
}

function zoomOf(event) { return Math.exp(-event.deltaY / 300); }

// Return the position of the other pressed pointer, if any; two pointers zoom.
function otherOf(pointers, event) { return [...pointers].find(([id]) => id !== event.pointerId)?.[1]; }

function spread([ax, ay], [bx, by]) { return Math.max(Math.hypot(ax - bx, ay - by), 1); }

// Return the cells on the straight line between two cells, because pointers skip cells. Halves are rounded towards
// the first cell.
function cellsBetween(from, to) {
  const offsets = to.map((end, axis) => end - from[axis]);
  const steps = Math.max(...offsets.map(Math.abs));
  const moved = (offset, k) => Math.sign(offset) * Math.ceil(k * Math.abs(offset) / steps - 0.5);
  return Array.from({ length: steps + 1 }, (_, k) => from.map((start, axis) => start + (k && moved(offsets[axis], k))));
}
