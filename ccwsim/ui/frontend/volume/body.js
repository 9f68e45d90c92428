// The 3D view (body) of a volume: rays cross a 3D texture cell by cell (WebGL2). One painter draws all
// volumes of a page. Edges and wells above the top are drawn on the canvas of the volume.
const TURN = 0.01, TURN_KEY = 0.12; // radians per pixel, and per press of an arrow key
const STEEPEST = 1.5; // maximum angle in radians of a view from above or below
const SEVERAL = 'several'; // the choice of facies with opacities
const BLOCKS = { block: [0, 1, 2], 'block x': [0], 'block y': [1], 'block z': [2] }; // axes of the cuts
const ALL = 1 << 20; // more cells than a volume has along an axis
const FAINT = 0.25; // initial opacity of the facies with index 0, which often surrounds the others
const OPAQUE = 0.9, BEHIND = 0.25; // minimum opacity of a cell that hides lines, and opacity of hidden lines
const FIRST_LOOK = { turn: 0.6, tilt: 0.5, zoom: 1 };
const QUICK = 35; // target milliseconds per frame in motion; slower machines draw coarser frames
const AT_REST = 180; // milliseconds without motion before a coarse frame is replaced by a fine frame
const PAUSE = 1000; // milliseconds before WebGL2 is requested again, doubled after each request
const MOST_REFUSALS = 9; // number of refusals after which WebGL2 is no longer requested
const KEPT = 4; // number of volumes in graphics memory
const BITS = 3, BRICK = 1 << BITS; // cells along an axis of a brick; rays cross an empty brick in one step

const CORNERS = `#version 300 es
in vec2 corner; out vec2 at; void main() { at = corner; gl_Position = vec4(corner, 0, 1); }`;
const RAYS = `#version 300 es
precision highp float; precision highp int; precision highp usampler3D;
#define BITS ${BITS}
uniform usampler3D cells; // index of the cell, and 1 + index of the colour of its datum
uniform usampler3D bricks; // 1 if a cell in the brick is shown because of the cell's index or datum
uniform sampler2D looks; // colours and opacities of the indices; below them, colours of data
uniform ivec3 n, cut, side; // the cells of a block between the cell \`cut\` and the viewer are omitted
uniform ivec3 whole; // large for axes along which all of these cells are omitted
uniform vec3 eye, right, up, along;
uniform bool solid_block, fine;
in vec2 at; out vec4 colour;

bool within(ivec3 k) { return all(greaterThanEqual(k, ivec3(0))) && all(lessThan(k, n)); }

bool taken_out(ivec3 k) { return solid_block && all(greaterThan((k - cut) * side + whole, ivec3(0))); }

bool empty(ivec3 brick) {
  ivec3 low = brick << BITS, high = min(low + (1 << BITS) - 1, n - 1);
  if (texelFetch(bricks, brick, 0).r > 0u) return false;
  return !solid_block || taken_out(ivec3(side.x > 0 ? low.x : high.x, side.y > 0 ? low.y : high.y, side.z > 0 ? low.z : high.z));
}

bool shown(ivec3 k) {
  if (taken_out(k)) return texelFetch(cells, k, 0).g > 0u;
  if (solid_block) return true;
  uvec2 cell = texelFetch(cells, k, 0).rg;
  return cell.g > 0u || texelFetch(looks, ivec2(cell.r, 0), 0).a > 0.;
}

float filled(ivec3 k) { return within(k) && shown(k) ? 1. : 0.; }

// Return the light at a point of a face; points beside protruding cells are darker.
float open(ivec3 front, ivec3 u, ivec3 v, vec2 f) {
  float l = filled(front - u), r = filled(front + u), b = filled(front - v), t = filled(front + v);
  vec4 corner = vec4(max(l + b, filled(front - u - v)), max(r + b, filled(front + u - v)),
    max(l + t, filled(front - u + v)), max(r + t, filled(front + u + v)));
  corner = 1. - 0.17 * min(corner, 2.);
  return mix(mix(corner.x, corner.y, f.x), mix(corner.z, corner.w, f.x), f.y);
}

void main() {
  vec3 from = eye + right * at.x + up * at.y, size = vec3(n);
  vec3 near = min(-from / along, (size - from) / along), far = max(-from / along, (size - from) / along);
  float enter = max(near.x, max(near.y, near.z)), leave = min(far.x, min(far.y, far.z));
  colour = vec4(0);
  if (enter >= leave) return;
  bvec3 hit = equal(near, vec3(enter)); // axes whose planes the ray crossed last
  ivec3 way = ivec3(sign(along)), first = (1 - way) / 2; // 1 if the ray points down an axis
  ivec3 k = clamp(ivec3(floor(from + along * enter)), ivec3(0), n - 1);
  k = ivec3(mix(vec3(k), vec3(first * (n - 1)), hit));
  vec3 stride = abs(1. / along);
  vec3 next = (vec3(k + 1 - first) - from) / along; // distances at which the ray leaves the cell, by axis
  float now = enter;
  ivec3 brick = ivec3(-1);
  int inside = -1; // index of the translucent cell that the ray has left
  for (int i = n.x + n.y + n.z; i >= 0; i--) {
    if (any(notEqual(k >> BITS, brick))) {
      brick = k >> BITS;
      if (empty(brick)) {
        ivec3 low = brick << BITS, high = min(low + (1 << BITS) - 1, n - 1);
        vec3 wall = (vec3((brick + 1 - first) << BITS) - from) / along;
        now = min(wall.x, min(wall.y, wall.z));
        hit = equal(wall, vec3(now));
        k = clamp(ivec3(floor(from + along * now)), low, high);
        k = ivec3(mix(vec3(k), vec3(((brick + 1 - first) << BITS) - first), hit));
        if (!within(k)) return;
        next = (vec3(k + 1 - first) - from) / along;
        inside = -1;
        continue;
      }
    }
    bool solid = shown(k);
    uvec2 cell = texelFetch(cells, k, 0).rg;
    int index = !solid ? -1 : cell.g > 0u ? 256 + int(cell.g) : int(cell.r);
    if (solid && index != inside) {
      vec4 look = cell.g > 0u ? texelFetch(looks, ivec2(cell.g - 1u, 1), 0) : texelFetch(looks, ivec2(cell.r, 0), 0);
      float light = hit.z ? (way.z < 0 ? 1. : 0.62) : hit.y ? 0.86 : 0.74;
      if (fine) {
        ivec3 side_on = hit.z ? ivec3(0, 0, 1) : hit.y ? ivec3(0, 1, 0) : ivec3(1, 0, 0);
        vec3 on = clamp(from + along * now - vec3(k), 0., 1.);
        light *= open(k - side_on * way, side_on.zxy, side_on.yzx, hit.z ? on.xy : hit.y ? on.zx : on.yz);
      }
      colour += (1. - colour.a) * look.a * vec4(look.rgb * light, 1);
      if (look.a > 0.99) return;
    }
    inside = index;
    now = min(next.x, min(next.y, next.z));
    hit = equal(next, vec3(now));
    k += ivec3(hit) * way;
    next += vec3(hit) * stride;
    if (!within(k)) return;
  }
}`;

class Painter {
  constructor() {
    this.canvas = new OffscreenCanvas(1, 1);
    const gl = this.gl = this.canvas.getContext('webgl2', { antialias: false, depth: false });
    if (!gl) throw new Error('no WebGL2');
    this.textures = new Map(); // textures by volume; the most recently drawn texture is last
    this.program = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, CORNERS], [gl.FRAGMENT_SHADER, RAYS]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(this.program) || 'WebGL2 was lost');
    }
    gl.useProgram(this.program);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 3, -1, -1, 3]), gl.STATIC_DRAW);
    const corner = gl.getAttribLocation(this.program, 'corner');
    gl.enableVertexAttribArray(corner);
    gl.vertexAttribPointer(corner, 2, gl.FLOAT, false, 0, 0);
    this.looks = this.texture(gl.TEXTURE_2D);
    this.bricks = this.texture(gl.TEXTURE_3D);
    this.places = {};
    for (const name of ['cells', 'looks', 'n', 'cut', 'side', 'whole', 'eye', 'right', 'up', 'along', 'solid_block', 'fine', 'bricks']) {
      this.places[name] = gl.getUniformLocation(this.program, name);
    }
    this.widest = gl.getParameter(gl.MAX_3D_TEXTURE_SIZE);
  }

  texture(kind) {
    const { gl } = this;
    const texture = gl.createTexture();
    gl.bindTexture(kind, texture);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(kind, filter, gl.NEAREST);
    return texture;
  }

  // Bind the texture of a volume and its data; create the texture if necessary.
  hold(stamp, shape, cells, data) {
    const { gl, textures } = this;
    gl.activeTexture(gl.TEXTURE0);
    const kept = textures.get(stamp) || this.texture(gl.TEXTURE_3D);
    gl.bindTexture(gl.TEXTURE_3D, kept);
    if (!textures.delete(stamp)) {
      const both = new Uint8Array(2 * cells.length);
      for (let k = 0; k < cells.length; k++) both[2 * k] = cells[k];
      for (const [k, colour] of data) both[2 * k + 1] = colour + 1;
      gl.texImage3D(gl.TEXTURE_3D, 0, gl.RG8UI, ...shape, 0, gl.RG_INTEGER, gl.UNSIGNED_BYTE, both);
    }
    textures.set(stamp, kept);
    if (textures.size <= KEPT) return;
    const [[oldest, texture]] = textures;
    gl.deleteTexture(texture);
    textures.delete(oldest);
  }

  // Bind the texture of bricks, in which a brick with a datum or a shown cell is 1.
  holdBricks(stamp, shape, cells, data, shown) {
    if (this.bricked === stamp) return;
    this.bricked = stamp;
    const { gl } = this;
    const [nx, ny, nz] = shape, [bx, by, bz] = shape.map((n) => Math.ceil(n / BRICK));
    const bricks = new Uint8Array(bx * by * bz);
    for (let z = 0, k = 0; z < nz; z++) {
      for (let y = 0; y < ny; y++) {
        const row = (Math.floor(z / BRICK) * by + Math.floor(y / BRICK)) * bx;
        for (let x = 0; x < nx; x++, k++) bricks[row + Math.floor(x / BRICK)] |= shown[cells[k]];
      }
    }
    for (const [k] of data) {
      const [x, y, z] = [k % nx, Math.floor(k / nx) % ny, Math.floor(k / nx / ny)].map((c) => Math.floor(c / BRICK));
      bricks[(z * by + y) * bx + x] = 1;
    }
    gl.activeTexture(gl.TEXTURE2);
    gl.bindTexture(gl.TEXTURE_3D, this.bricks);
    gl.texImage3D(gl.TEXTURE_3D, 0, gl.R8UI, bx, by, bz, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, bricks);
  }

  // Wait until the frame is drawn, to measure the drawing time.
  wait() {
    const { gl } = this;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  paint(wide, high, looks, values) {
    const { gl, places } = this;
    if (this.canvas.width !== wide || this.canvas.height !== high) Object.assign(this.canvas, { width: wide, height: high });
    gl.viewport(0, 0, wide, high);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.looks);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 2, 0, gl.RGBA, gl.UNSIGNED_BYTE, looks);
    ['cells', 'looks', 'bricks'].forEach((name, k) => gl.uniform1i(places[name], k));
    for (const name of ['solid_block', 'fine']) gl.uniform1i(places[name], values[name]);
    for (const name of ['n', 'cut', 'side', 'whole']) gl.uniform3iv(places[name], values[name]);
    for (const name of ['eye', 'right', 'up', 'along']) gl.uniform3fv(places[name], values[name]);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return this.canvas;
  }
}

class Body {
  constructor(view) {
    this.view = view;
    this.panel = view.root.querySelector('[data-panel="body"]');
    this.canvas = this.panel.querySelector('canvas');
    this.mode = this.panel.querySelector('.mode');
    this.sliders = this.panel.querySelector('.sliders');
    this.coarse = 1;
    this.pointers = new Map();
    this.listen();
  }

  get look() { return (this.view.shared.look ??= { ...FIRST_LOOK }); }

  // Offer the modes of the view; volumes with the same cursor use the same mode, if all offer it.
  show() {
    const { view: { data, local, shared }, mode } = this;
    const modes = data.strip ? [['from', 'cells from a value on']]
      : [...data.labels.map((label, k) => [String(k), `${label} alone`]), [SEVERAL, 'facies with opacity']];
    modes.unshift(...Object.entries(BLOCKS).map(([name, axes]) => [name, axes.length > 1
      ? 'block, a corner cut out' : `block, cut across ${'xyz'[axes[0]]}`]));
    mode.replaceChildren(...modes.map(([value, text]) => new Option(text, value)));
    const offered = (value) => modes.some(([one]) => one === value);
    mode.value = [shared.mode, local.mode, data.mode].find(offered) ?? 'block';
    local.mode = mode.value;
    this.choose();
  }

  // Offer a slider for the lowest value, for the place of a cut, or for the opacity of each facies.
  choose() {
    const { view } = this;
    const { data: { labels, shape }, local, shared } = view;
    const mode = this.mode.value, [axis] = this.across;
    const sliders = [];
    if (mode === 'from') {
      sliders.push(['from', 'Lowest value shown in the volume', labels.length - 1, (k) => labels[k], () => this.from, (k) => {
        local.from = k;
        view.ask('body', true);
      }]);
    } else if (this.across.length === 1) {
      const name = 'xyz'[axis];
      sliders.push([name, `Place of the cut across ${name}`, shape[axis] - 1, String, () => view.at[axis],
        (k) => view.moveTo(view.at.with(axis, k))]);
    } else if (mode === SEVERAL) {
      labels.forEach((label, k) => sliders.push([label, `Opacity of ${label}`, 100, (share) => `${share} %`,
        () => Math.round(100 * this.opacities()[k]), (share) => {
          shared.opacities = this.opacities().with(k, share / 100);
          view.tell('look');
        }]));
    }
    this.sliders.replaceChildren(...sliders.map((one) => sliderOf(...one)));
  }

  // Let the sliders show values that another view of the same link has changed.
  follow() { [...this.sliders.children].forEach((slide) => slide.follow()); }

  layout(wide, high, dots) {
    this.dots = dots;
    sizeCanvas(this.canvas, wide, high, dots);
  }

  // Return the painter of the page, or undefined without WebGL2. A busy browser may lose WebGL2 or refuse it for a
  // moment, or for two minutes after its drawing process has ended, so WebGL2 is requested again.
  painter() {
    const { page } = this.view;
    if (page.painter?.gl.isContextLost()) page.painter = undefined;
    if (page.painter || performance.now() < page.askAgain) return page.painter;
    try {
      page.painter = new Painter();
    } catch {
      page.refusals = (page.refusals ?? 0) + 1;
      page.askAgain = page.refusals < MOST_REFUSALS ? performance.now() + PAUSE * 2 ** (page.refusals - 1) : Infinity;
    }
    return page.painter;
  }

  missing() {
    const painter = this.painter();
    if (!painter) return 'The volume itself is not drawn, as this browser has no WebGL2. The slices show all of its cells.';
    const longest = Math.max(...this.view.data.shape);
    if (longest > painter.widest) return `The 3D view is not drawn, because this browser allows ${painter.widest} cells along an axis, not ${longest}. The slices show all cells.`;
    return '';
  }

  // Return unit vectors in space: right and up on the screen, and the direction of view.
  frame() {
    const { turn, tilt } = this.look;
    const [s, c, st, ct] = [Math.sin(turn), Math.cos(turn), Math.sin(tilt), Math.cos(tilt)];
    return { right: [c, s, 0], up: [-s * st, c * st, ct], along: [-s * ct, c * ct, -st].map((d) => d || 1e-9) };
  }

  draw(moving) {
    const { view, canvas, look } = this;
    const { data, at } = view;
    const text = this.missing();
    const line = this.panel.querySelector('.missing');
    line.textContent = text;
    line.hidden = !text;
    canvas.hidden = this.mode.hidden = Boolean(text);
    if (text) {
      this.sliders.replaceChildren();
      const { painter, askAgain } = view.page;
      if (!painter && askAgain < Infinity) setTimeout(() => view.ask('body'), Math.max(0, askAgain - performance.now()));
      return;
    }
    canvas.setAttribute('aria-label', `${data.alt}, ${this.mode.selectedOptions[0].text}, seen from ${compass(look)}`);
    const { right, up, along } = this.frame();
    const sizes = data.cell_size.map((size, axis) => size * (axis === 2 ? view.exaggeration : 1));
    const world = data.shape.map((n, axis) => n * sizes[axis]);
    const [wide, high] = [parseFloat(canvas.style.width), parseFloat(canvas.style.height)];
    const pixels = look.zoom * Math.min(wide, 1.2 * high) / Math.hypot(...world);
    const toCanvas = (x, y, z) => {
      const off = [x * sizes[0] - world[0] / 2, y * sizes[1] - world[1] / 2, z * sizes[2] - world[2] / 2];
      const dot = (axis) => off[0] * axis[0] + off[1] * axis[1] + off[2] * axis[2];
      return [wide / 2 + dot(right) * pixels, high / 2 - dot(up) * pixels];
    };
    const { isBlock: block, across } = this;
    const inCells = (vector, factor) => vector.map((v, axis) => v * factor / sizes[axis]);
    const away = Math.hypot(...world);
    const side = along.map((d) => (d < 0 ? 1 : -1));
    const opacities = this.opacities();
    const values = { n: data.shape, cut: at, side, solid_block: block,
      whole: [0, 1, 2].map((axis) => (across.includes(axis) ? 0 : ALL)),
      eye: data.shape.map((n, axis) => n / 2 - along[axis] * away / sizes[axis]),
      right: inCells(right, wide / 2 / pixels), up: inCells(up, high / 2 / pixels), along: inCells(along, 1) };
    const began = performance.now();
    const painter = this.painter();
    const coarse = moving ? this.coarse : 1;
    const points = (view.shows.data ? data.points : []).map(
      ([layer, row, column, index]) => [(layer * data.shape[1] + row) * data.shape[0] + column, index]);
    const stamp = `${data.digest} ${data.shape} ${points.join()}`;
    const shown = opacities.map((opacity) => !block && opacity > 0);
    painter.hold(stamp, data.shape, view.cells, points);
    painter.holdBricks(`${stamp} ${shown}`, data.shape, view.cells, points, shown);
    values.fine = coarse === 1;
    const scene = painter.paint(Math.ceil(wide * this.dots * coarse), Math.ceil(high * this.dots * coarse),
      this.looks(opacities), values);
    if (moving) painter.wait();
    const pen = canvas.getContext('2d');
    pen.setTransform(this.dots, 0, 0, this.dots, 0, 0);
    pen.clearRect(0, 0, wide, high);
    pen.strokeStyle = pen.fillStyle = styleOf(view.root, '--st-text-color');
    this.drawEdges(pen, toCanvas, side, true);
    if (look.tilt < 0) this.drawStems(pen, toCanvas, block, side);
    pen.imageSmoothingEnabled = coarse < 1;
    pen.drawImage(scene, 0, 0, wide, high);
    this.drawLines(pen, toCanvas, (k) => (block
      ? k.some((c, axis) => (c - at[axis]) * side[axis] + values.whole[axis] <= 0)
      : opacities[view.cells[(k[2] * data.shape[1] + k[1]) * data.shape[0] + k[0]]] > OPAQUE), values.along);
    this.drawEdges(pen, toCanvas, side, false);
    if (look.tilt >= 0) this.drawStems(pen, toCanvas, block, side);
    this.took = performance.now() - began;
    this.coarse = Math.min(1, Math.max(0.25, coarse * Math.sqrt(QUICK / this.took)));
    clearTimeout(this.rest);
    if (coarse < 1) this.rest = setTimeout(() => view.ask('body'), AT_REST);
  }

  // Return the opacity of each index, from 0 (not shown) to 1.
  opacities() {
    const { data, shared } = this.view;
    const mode = this.mode.value;
    if (mode === SEVERAL) return data.lut.map((_, k) => (shared.opacities ?? data.opacities)?.[k] ?? usualOpacity(k));
    if (mode === 'from') return data.lut.map((_, k) => Number(k >= this.from));
    return data.lut.map((_, k) => Number(this.isBlock || k === +mode));
  }

  get isBlock() { return this.mode.value.startsWith('block'); }

  // Return the axes across which a block is cut.
  get across() { return BLOCKS[this.mode.value] ?? []; }

  get from() { return Math.min(this.view.local.from ?? this.view.data.lut.length >> 1, this.view.data.lut.length - 1); }

  // Return two rows of 256 colours: for indices, with their opacities, and for data.
  looks(opacities) {
    const { data } = this.view;
    const looks = new Uint8Array(2 * 256 * 4);
    data.lut.forEach((colour, k) => looks.set([...rgbOf(colour), Math.round(255 * opacities[k])], 4 * k));
    (data.point_lut || data.lut).forEach((colour, k) => looks.set([...rgbOf(colour), 255], 4 * (256 + k)));
    return looks;
  }

  // Draw lines; a part is faint if a cell with `hides(cell)` is between this part and the viewer.
  drawLines(pen, toCanvas, hides, along) {
    const { lines = [], line_lut: lut, shape } = this.view.data;
    const longest = Math.max(...along.map(Math.abs)), step = along.map((d) => -d / longest);
    const isHidden = (at) => {
      for (const place = [...at]; place.every((c, axis) => c >= 0 && c < shape[axis]); step.forEach((d, axis) => { place[axis] += d; })) {
        if (hides(place.map(Math.floor))) return true;
      }
      return false;
    };
    pen.save();
    pen.lineJoin = pen.lineCap = 'round';
    for (const line of lines) {
      const spots = line.map(([layer, row, column]) => toCanvas(column, row, layer));
      const alphas = line.slice(1).map(([z, y, x], k) => (
        isHidden([x + line[k][2], y + line[k][1], z + line[k][0]].map((sum) => sum / 2)) ? BEHIND : 1));
      // the outline first, without a gap where the colour changes
      for (const [share, wide, colourOf] of [[0.7, 3, () => INK], [1, 1.6, (k) => lut[line[k + 1][3]]]]) {
        for (let first = 0, k = 1; k < line.length; k++) {
          if (alphas[k] === alphas[first] && colourOf(first) === (line[k + 1] && colourOf(k))) continue;
          strokeIn(pen, [[colourOf(first), wide, share * alphas[first]]], () => (
            spots.slice(first, k + 1).forEach((spot) => pen.lineTo(...spot))));
          first = k;
        }
      }
    }
    pen.restore();
  }

  // Draw the edges of the box behind or in front of the volume, and the names of the axes.
  drawEdges(pen, toCanvas, side, behind) {
    const { shape } = this.view.data;
    strokeIn(pen, [[pen.fillStyle, 1, behind ? 0.35 : 0.5]], () => {
      for (let axis = 0; axis < 3; axis++) {
        const [b, c] = [(axis + 1) % 3, (axis + 2) % 3];
        for (const [i, j] of [[-1, -1], [-1, 1], [1, -1], [1, 1]]) {
          if ((i !== side[b] && j !== side[c]) !== behind) continue;
          const end = [0, 0, 0];
          end[b] = i > 0 ? shape[b] : 0;
          end[c] = j > 0 ? shape[c] : 0;
          pen.moveTo(...toCanvas(...end));
          end[axis] = shape[axis];
          pen.lineTo(...toCanvas(...end));
        }
      }
    });
    if (behind) return;
    pen.font = fontOf(this.view.root);
    pen.textAlign = 'center';
    pen.textBaseline = 'middle';
    const middle = toCanvas(...shape.map((n) => n / 2)), wide = parseFloat(this.canvas.style.width);
    const near = side.map((s, axis) => (s > 0 ? shape[axis] : 0));
    const ends = [[shape[0] / 2, near[1], 0], [near[0], shape[1] / 2, 0], [shape[0] - near[0], near[1], shape[2] / 2]];
    ends.forEach((end, axis) => {
      const [x, y] = toCanvas(...end);
      const far = Math.hypot(x - middle[0], y - middle[1]) || 1;
      const beside = x + 11 * (x - middle[0]) / far;
      pen.fillText('xyz'[axis], clamp(beside, 5, wide - 5), y + 11 * (y - middle[1]) / far);
    });
  }

  // Draw the paths of wells in the colours of their data, extended above the top, so that hidden wells are visible too.
  drawStems(pen, toCanvas, block, side) {
    const { view } = this;
    if (!view.shows.data) return;
    const { shape } = view.data;
    const [, base] = toCanvas(0, 0, 0), [, top] = toCanvas(0, 0, shape[2]);
    const stem = Math.max(12, 0.12 * (base - top));
    const names = [], colour = pen.strokeStyle;
    for (const well of view.wells) {
      const [high, y, x] = well.top;
      const open = !block || (side[2] > 0 && (x - view.at[0]) * side[0] > 0 && (y - view.at[1]) * side[1] > 0);
      const [px, py] = toCanvas(x + 0.5, y + 0.5, open ? high + 1 : shape[2]);
      const [, head] = toCanvas(x + 0.5, y + 0.5, shape[2]);
      const cells = [...well.cells].sort((one, other) => other[0] - one[0]);
      const path = cells.map(([layer, row, column]) => toCanvas(column + 0.5, row + 0.5, layer + 0.5));
      const middle = (k) => path[k].map((place, axis) => (place + (path[k - 1] ?? path[k])[axis]) / 2);
      strokeIn(pen, [[PAPER, 5, 0.5], [INK, 3.5, 0.8]], () => path.forEach((spot) => pen.lineTo(...spot)));
      for (let first = 0, k = 1; k <= path.length; k++) { // cells of equal facies at once
        if (k < path.length && view.colourOf(cells[k]) === view.colourOf(cells[first])) continue;
        const end = k < path.length ? middle(k) : path.at(-1);
        strokeIn(pen, [[view.colourOf(cells[first]), 2.5]], () => (
          [middle(first), ...path.slice(first, k), end].forEach((spot) => pen.lineTo(...spot))));
        first = k;
      }
      strokeIn(pen, [[colour, 1.25]], () => {
        pen.moveTo(px, py);
        pen.lineTo(px, head - stem);
      });
      disc(pen, px, head - stem, 2.2, colour);
      if (well.name) names.push([well.name, px, head - stem]);
    }
    const box = { root: view.root, left: 0, wide: parseFloat(this.canvas.style.width) };
    drawNames(pen, box, names, view.data.max_names);
  }

  turnBy(turn, tilt) {
    const { look } = this;
    this.lookFrom({ turn: look.turn + turn, tilt: clamp(look.tilt + tilt, -STEEPEST, STEEPEST) });
  }

  zoomBy(factor) { this.lookFrom({ zoom: clamp(this.look.zoom * factor, 0.5, 12) }); }

  lookFrom(changes) {
    this.view.shared.look = { ...this.look, ...changes };
    this.view.tell('look');
  }

  listen() {
    const { canvas, view, pointers } = this;
    this.mode.addEventListener('change', () => {
      view.local.mode = view.shared.mode = this.mode.value;
      view.tell('mode');
    });
    const release = (event) => pointers.delete(event.pointerId);
    hearWheel(canvas, (event) => this.zoomBy(zoomOf(event)));
    hear(canvas, {
      pointerdown: (event) => {
        canvas.focus();
        canvas.setPointerCapture(event.pointerId);
        pointers.set(event.pointerId, [event.clientX, event.clientY]);
      },
      pointermove: (event) => {
        const before = pointers.get(event.pointerId);
        if (!before) return;
        const now = [event.clientX, event.clientY], other = otherOf(pointers, event);
        if (other) this.zoomBy(spread(now, other) / spread(before, other));
        else this.turnBy(-(now[0] - before[0]) * TURN, (now[1] - before[1]) * TURN);
        pointers.set(event.pointerId, now);
      },
      pointerup: release,
      pointercancel: release,
      dblclick: () => this.lookFrom(FIRST_LOOK),
    });
    hearKeys(canvas, ({ key }) => {
      const turns = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[key];
      const zoom = { '+': 1.25, '=': 1.25, '-': 0.8 }[key];
      if (turns) this.turnBy(...turns.map((way) => way * TURN_KEY));
      if (zoom) this.zoomBy(zoom);
      if (key === '0') this.lookFrom(FIRST_LOOK);
      return turns || zoom || key === '0';
    });
  }
}

function usualOpacity(k) { return k ? 1 : FAINT; }

// Return a slider whose text is `say(value)`; `act` is called with each new value, `read` returns the present one.
function sliderOf(text, label, max, say, read, act) {
  const slider = element('input', { type: 'range', min: 0, max, ariaLabel: label }), output = element('output');
  const slide = element('label', { className: 'slide' }, element('span', {}, text), slider, output);
  slide.follow = () => {
    slider.value = read();
    output.textContent = say(+slider.value);
    slider.setAttribute('aria-valuetext', output.textContent);
  };
  slider.addEventListener('input', () => {
    act(+slider.value);
    slide.follow();
  });
  slide.follow();
  return slide;
}

function compass({ turn, tilt }) {
  const names = ['south', 'southeast', 'east', 'northeast', 'north', 'northwest', 'west', 'southwest'];
  const eighth = Math.round(turn / (Math.PI / 4));
  return `the ${names[((eighth % 8) + 8) % 8]} and ${tilt < 0 ? 'below' : 'above'}`;
}
