// Small multiples: a labelled picture a setting, each a button; arrow keys go on.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const sheet = parentElement.querySelector('.settings');
  const { tiles, shown } = data;
  // on a phone three stand in a row
  const share = Math.min(1, ((sheet.clientWidth || 1e4) - 36) / 3 / data.width);
  const [width, height] = share < 0.5 ? [data.width, data.height]
    : [Math.floor(data.width * share), Math.floor(data.height * share)];
  const ready = tiles.filter((tile) => tile.png).length;
  sheet.setAttribute('role', 'group');
  sheet.setAttribute('aria-label', 'Settings; arrow keys choose');
  while (sheet.children.length > tiles.length) sheet.lastChild.remove();
  while (sheet.children.length < tiles.length) sheet.append(empty());
  [...sheet.children].forEach((button, k) => {
    const { png, label, note, recommended } = tiles[k];
    const [picture, name, below] = button.children;
    button.disabled = !png;
    button.style.width = Math.max(width, 96) + 'px';
    picture.style.width = width + 'px';
    picture.style.height = height + 'px';
    picture.style.backgroundImage = png ? `url(data:image/png;base64,${png})` : 'none';
    picture.firstChild.textContent = recommended ? 'recommended' : '';
    picture.firstChild.hidden = !recommended;
    name.textContent = label;
    below.textContent = note;
    button.setAttribute('aria-label', `Setting ${label}`);
  });
  const mark = (chosen) => [...sheet.children].forEach((button, k) => {
    button.setAttribute('aria-pressed', k === chosen);
    button.tabIndex = k === chosen ? 0 : -1;
  });
  const choose = (k) => {
    mark(k);
    sheet.children[k].focus({ preventScroll: true });
    setTriggerValue('chosen', k);
  };
  mark(shown);
  sheet.onclick = (event) => {
    const button = event.target.closest('button');
    if (button && !button.disabled) choose([...sheet.children].indexOf(button));
  };
  sheet.onkeydown = (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step || !ready) return;
    event.preventDefault();
    const now = [...sheet.children].findIndex((b) => b.getAttribute('aria-pressed') === 'true');
    choose((now + step + ready) % ready);
  };
});

function empty() {
  const button = document.createElement('button');
  button.type = 'button';
  for (const name of ['picture', 'label', 'note']) {
    const part = document.createElement(name === 'picture' ? 'div' : 'span');
    part.className = name;
    button.append(part);
  }
  const star = document.createElement('span');
  star.className = 'star';
  button.firstChild.append(star);
  return button;
}
