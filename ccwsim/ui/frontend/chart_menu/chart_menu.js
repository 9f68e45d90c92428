// Saves the chart below the menu: plotly writes PNG and SVG; CSV is written from the chart's numbers.
const LETTER = 5.2;  // mean width of a letter of a caption in pixels
const LINE = 15;

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
    const charts = [...document.querySelectorAll(`.st-key-${data.chart} .js-plotly-plot`)];
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
    const shown = chart.layout;
    chart.layout = captioned(chart, title, caption);  // plotly copies it at the click
    const { width, height } = chart.layout;
    chart._context.toImageButtonOptions = {
      format: kind, filename: name, scale: kind === 'png' ? 3 : 1, width, height,
    };
    chart.querySelector('.modebar-btn').click();
    chart.layout = shown;
  }
}

// Return the layout of a chart with its title and the caption above, in lines as wide as the chart.
function captioned({ layout, _fullLayout: full }, title, caption) {
  const lines = [];
  for (const word of caption.split(' ').filter(Boolean)) {
    const longer = lines.length ? `${lines.at(-1)} ${word}` : word;
    if (lines.length && longer.length * LETTER < full.width - 16) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  const small = lines.map((line) => `<span style="font-size: 10px">${written(line)}</span>`);
  const room = LINE * (lines.length + 2);
  return {
    ...layout, width: full.width, height: full.height + room,
    margin: { ...layout.margin, t: (layout.margin?.t ?? 0) + room },
    title: {
      text: [`<b>${written(title)}</b>`, ...small].join('<br>'), font: { size: 13 },
      x: 8 / full.width, xanchor: 'left', y: 1, yanchor: 'top', yref: 'container', pad: { t: 14 },
    },
  };
}

function written(text) { return text.replaceAll('&', '&amp;').replaceAll('<', '&lt;'); }

// Return a CSV line for each point, with the name of its series and the number of its curve. Gaps separate the
// curves of a series.
function table(chart) {
  const layout = chart._fullLayout;
  const titles = [text(layout.xaxis) || 'x', text(layout.yaxis) || 'y'];
  const maps = chart._fullData.some((trace) => trace.z);
  const lines = [['series', 'curve', ...titles, ...(maps ? ['value'] : [])]];
  for (const trace of chart._fullData) (trace.z ? grid : curves)(trace, lines);
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

function saveText(name, content) {
  const address = URL.createObjectURL(new Blob([content], { type: 'text/csv' }));
  download(name, address);
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}
