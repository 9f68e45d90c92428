// A histogram of values with a line at each limit between classes; dragging or arrow keys move a line.
const BELOW = 20; // height in pixels of the numbers below the bars
const STEPS = 200; // number of arrow-key steps over the range of values

export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const root = parentElement.querySelector('.histogram');
  const canvas = root.querySelector('canvas');
  const { counts, low, high, label } = data;
  const edges = [...data.edges];
  const span = high - low || 1;
  const place = (value) => (value - low) / span;
  const rounded = (value) => Number(value.toPrecision(4));

  const draw = () => {
    const { width, height } = root.getBoundingClientRect();
    const dots = window.devicePixelRatio || 1;
    Object.assign(canvas, { width: width * dots, height: height * dots });
    const pen = canvas.getContext('2d');
    pen.scale(dots, dots);
    pen.fillStyle = styleOf(root, '--st-text-color');
    pen.globalAlpha = 0.45;
    const most = Math.max(...counts), wide = width / counts.length, room = height - BELOW;
    counts.forEach((count, k) => {
      const high = count ? Math.max(1, room * count / most) : 0;
      pen.fillRect(k * wide, room - high, Math.max(wide - 1, 1), high);
    });
    pen.globalAlpha = 1;
    pen.font = fontOf(root);
    const write = (text, x, align) => { pen.textAlign = align; pen.fillText(text, x, height - 5); };
    write(String(rounded(low)), 0, 'left');
    write(String(rounded(high)), width, 'right');
    pen.font = '600 ' + pen.font;
    edges.forEach((edge) => write(String(edge), clamp(place(edge), 0.12, 0.88) * width, 'center'));
  };

  const kept = [...root.querySelectorAll('button')];
  const added = () => root.appendChild(element('button', { type: 'button', role: 'slider' }));
  const handles = edges.map((_, k) => kept[k] ?? added());
  kept.slice(edges.length).forEach((spare) => spare.remove());
  const least = span / STEPS;
  const move = (k, value) => {
    const from = k ? edges[k - 1] + least : low + least / 10, to = k + 1 < edges.length ? edges[k + 1] - least : high;
    edges[k] = rounded(clamp(value, from, to));
    show(k);
    draw();
  };
  const show = (k) => {
    handles[k].style.left = 100 * place(edges[k]) + '%';
    const ariaLabel = edges.length > 1 ? `${label} ${k + 1}` : label;
    Object.assign(handles[k], { ariaLabel, ariaValueNow: edges[k], ariaValueMin: low, ariaValueMax: high });
  };
  const tell = () => { if (edges.join() !== data.edges.join()) setTriggerValue('edges', edges); };
  handles.forEach((button, k) => {
    show(k);
    button.onpointerdown = (event) => button.setPointerCapture(event.pointerId);
    button.onpointermove = (event) => {
      if (!button.hasPointerCapture(event.pointerId)) return;
      const box = root.getBoundingClientRect();
      move(k, low + span * (event.clientX - box.left) / box.width);
    };
    button.onpointerup = tell;
    button.onkeydown = (event) => {
      const step = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
      if (!step) return;
      event.preventDefault();
      move(k, edges[k] + step * least);
      tell();
    };
  });
  const sizes = new ResizeObserver(draw);
  sizes.observe(root);
  return () => sizes.disconnect();
});
