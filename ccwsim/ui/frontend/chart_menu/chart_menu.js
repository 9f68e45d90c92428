// Saves the chart below the menu: Plotly writes PNG and SVG of its charts; other charts are SVG. CSV is written
// from the chart's numbers.
const LETTER = 5.2;  // mean width of a letter of a caption in pixels
const LINE = 15;
const SCALE = 3; // pixels of a PNG in each pixel on the screen

export default inOrder(({ data, parentElement }) => {
  const open = parentElement.querySelector('.open');
  const choices = parentElement.querySelector('.choices');
  open.setAttribute('aria-label', `Save ${data.title}`);
  const show = (on) => {
    choices.hidden = !on;
    open.setAttribute('aria-expanded', on);
  };
  open.onclick = () => show(choices.hidden);
  choices.onclick = (event) => {
    const kind = event.target.dataset.kind;
    if (!kind) return;
    const charts = [...document.querySelectorAll(`.st-key-${data.chart} :is(.js-plotly-plot, .chart)`)];
    if (charts.length) save(charts, kind, data);
    show(false);
  };
  return hear(document, {
    pointerdown: (event) => { if (!event.composedPath().includes(parentElement)) show(false); },
    keydown: (event) => { if (event.key === 'Escape') show(false); },
  });
});

function save(charts, kind, { name, title }) {
  if (kind === 'csv') return saveText(name + '.csv', charts.map(table).join('\n'));
  const caption = document.querySelector('.chart-caption')?.textContent ?? '';
  for (const chart of charts) {
    if (chart.figure) saveDrawn(chart, title, caption, kind, name);
    else savePlotly(chart, title, caption, kind, name);
  }
}

// Return the lines of a caption above a chart.
function linesOf(caption, width) {
  const lines = [];
  for (const word of caption.split(' ').filter(Boolean)) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
    if (lines.length && longer.length * LETTER < width - 16) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

function savePlotly(chart, title, caption, format, filename) {
  const { layout, _fullLayout: { width, height: high } } = chart, lines = linesOf(caption, width);
  const small = lines.map((line) => `<span style="font-size: 10px">${written(line)}</span>`);
  const room = LINE * (lines.length + 2), height = high + room;
  chart.layout = {
    ...layout, width, height, margin: { ...layout.margin, t: (layout.margin?.t ?? 0) + room },
    title: {
      text: [`<b>${written(title)}</b>`, ...small].join('<br>'), font: { size: 13 },
      x: 8 / width, xanchor: 'left', y: 1, yanchor: 'top', yref: 'container', pad: { t: 14 },
    },
  };
  const scale = format === 'png' ? SCALE : 1;
  chart._context.toImageButtonOptions = { format, filename, scale, width, height };
  chart.querySelector('.modebar-btn').click(); // copies the layout
  chart.layout = layout;
}

// Save an SVG with a title and a caption above as a file, or as the PNG of its picture.
function saveDrawn({ figure, firstElementChild: svg }, title, caption, kind, name) {
  const copy = svg.cloneNode(true), width = svg.clientWidth, lines = linesOf(caption, width);
  const room = LINE * (lines.length + 2), height = svg.clientHeight + room;
  const parts = [title, ...lines].map((line, k) => `<tspan x="8" y="${LINE * (k + 1.2) - room}" font-size="${k ? 10 : 13}"
    font-weight="${k ? 400 : 700}">${written(line)}</tspan>`);
  copy.insertAdjacentHTML('afterbegin', `<text fill="${figure.layout.font.color}">${parts.join('')}</text>`);
  copy.setAttribute('height', height);
  copy.setAttribute('viewBox', `0 ${-room} ${width} ${height}`);
  const text = new XMLSerializer().serializeToString(copy);
  if (kind === 'svg') return saveText(`${name}.svg`, text, 'image/svg+xml');
  const picture = element('img', { src: `data:image/svg+xml,${encodeURIComponent(text)}` });
  picture.onload = () => {
    const canvas = element('canvas', { width: SCALE * width, height: SCALE * height });
    canvas.getContext('2d').drawImage(picture, 0, 0, canvas.width, canvas.height);
    download(`${name}.png`, canvas.toDataURL());
  };
}

function written(text) { return text.replaceAll('&', '&amp;').replaceAll('<', '&lt;'); }

// Return a CSV line for each point, with the name of its series and the number of its curve. Gaps separate the
// curves of a series.
function table(chart) {
  const { layout, data } = chart.figure ?? { layout: chart._fullLayout, data: chart._fullData };
  const titles = [text(layout.xaxis) || 'x', text(layout.yaxis) || 'y'];
  const maps = data.some((trace) => trace.z);
  const lines = [['series', 'curve', ...titles, ...(maps ? ['value'] : [])]];
  for (const trace of data) (trace.z ? grid : curves)(trace, lines);
  return lines.map((line) => line.map(cell).join(',')).join('\n') + '\n';
}

function curves({ name, x, y }, lines) {
  let curve = 1, begun = false;
  x.forEach((place, k) => {
    const isGap = place == null || Number.isNaN(place);
    if (isGap && begun) curve += 1;
    begun = !isGap;
    if (begun) lines.push([name, curve, place, y[k]]);
  });
}

function grid(trace, lines) {
  [...trace.y].forEach((y, row) => [...trace.x].forEach((x, column) => {
    lines.push([trace.name, 1, x, y, trace.z[row][column]]);
  }));
}

function text(axis) { return axis?.title?.text ?? ''; }

// An apostrophe prevents a spreadsheet from reading a name as a formula, as in csv_table.py.
const FORMULA = /(?:^|(?<=;)|(?<=.\t))(?=[=+\-@\t\r\n＝＋－＠])/g;

function cell(value) {
  if (value == null || Number.isNaN(value)) return '';
  const content = Number.isNaN(Number(value)) ? String(value).replace(FORMULA, "'") : String(value);
  return /[",\r\n]/.test(content) ? `"${content.replace(/"/g, '""')}"` : content;
}

function saveText(name, content, type = 'text/csv') {
  const address = URL.createObjectURL(new Blob([content], { type }));
  download(name, address);
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
