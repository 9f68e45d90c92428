// Saves the chart below the menu: plotly writes PNG and SVG; CSV is written from the chart's numbers.
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
    if (charts.length) save(charts, kind, data.name);
    show(false);
  };
  const away = (event) => { if (!event.composedPath().includes(parentElement)) show(false); };
  const escape = (event) => { if (event.key === 'Escape') show(false); };
  document.addEventListener('pointerdown', away);
  document.addEventListener('keydown', escape);
  return () => {
    document.removeEventListener('pointerdown', away);
    document.removeEventListener('keydown', escape);
  };
});

function save(charts, kind, name) {
  if (kind === 'csv') return download(name + '.csv', charts.map(table).join('\n'));
  for (const chart of charts) {
    chart._context.toImageButtonOptions = {
      format: kind, filename: name, scale: kind === 'png' ? 3 : 1,
    };
    chart.querySelector('.modebar-btn').click();
  }
}

// Return a CSV line per point, with the numbers of series and curve; gaps separate curves of a series.
function table(chart) {
  const layout = chart._fullLayout;
  const titles = [text(layout.xaxis) || 'x', text(layout.yaxis) || 'y'];
  const maps = chart._fullData.some((trace) => trace.z);
  const lines = [['series', 'curve', ...titles, ...(maps ? ['value'] : [])]];
  for (const trace of chart._fullData) {
    if (trace.z) grid(trace, lines);
    else curves(trace, lines);
  }
  return lines.map((line) => line.map(cell).join(',')).join('\n') + '\n';
}

function curves(trace, lines) {
  let curve = 1;
  let begun = false;
  for (let k = 0; k < trace.x.length; k++) {
    const [x, y] = [trace.x[k], trace.y[k]];
    if (x == null || Number.isNaN(x)) {
      if (begun) curve += 1;
      begun = false;
    } else {
      begun = true;
      lines.push([trace.name, curve, x, y]);
    }
  }
}

function grid(trace, lines) {
  [...trace.y].forEach((y, row) => [...trace.x].forEach((x, column) => {
    lines.push([trace.name, 1, x, y, trace.z[row][column]]);
  }));
}

function text(axis) {
  return axis && axis.title ? axis.title.text : '';
}

// An apostrophe keeps a spreadsheet from taking a name for a formula, as in csv_table.py.
function cell(value) {
  if (value == null || Number.isNaN(value)) return '';
  const isFormula = /^[=+\-@\t\r\n]/.test(value) && Number.isNaN(Number(value));
  const said = (isFormula ? "'" : '') + value;
  return /[",\r\n]/.test(said) ? `"${said.replace(/"/g, '""')}"` : said;
}

function download(name, content) {
  const link = document.createElement('a');
  link.download = name;
  link.href = URL.createObjectURL(new Blob([content], { type: 'text/csv' }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
