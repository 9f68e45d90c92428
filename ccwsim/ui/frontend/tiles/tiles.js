// Pictures as buttons: realizations, bundled images, runs, settings, or guesses. `kind` is their style; arrow keys,
// Home and End `choose` a tile, only `move` to it, or do nothing.
const ARROWS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const box = parentElement.querySelector('.tiles');
  const tile = parentElement.querySelector('template').content.firstElementChild;
  const { kind, heading, tiles, shown, arrows } = data;
  const focused = [...box.children].findIndex((button) => button.matches(':focus'));
  box.className = `tiles ${kind}`;
  box.setAttribute('aria-label', heading);
  while (box.children.length > tiles.length) box.lastChild.remove();
  while (box.children.length < tiles.length) box.append(tile.cloneNode(true));
  const buttons = [...box.children];
  buttons.forEach((button, k) => fill(button, { ...data, ...tiles[k] }, k));
  const mark = (chosen, reached) => buttons.forEach((button, k) => {
    button.setAttribute(arrows === 'move' ? 'aria-current' : 'aria-pressed', k === chosen);
    button.tabIndex = !arrows || k === reached ? 0 : -1;
  });
  const moveTo = (chosen, reached) => {
    mark(chosen, reached);
    buttons[reached].focus({ preventScroll: true });
    reveal(box, buttons[reached]);
  };
  const choose = (k) => {
    if (arrows === 'choose') moveTo(k, k);
    setTriggerValue('chosen', tiles[k].value ?? k);
  };
  mark(shown, arrows === 'move' && buttons[focused] ? focused : Math.max(shown, 0));
  if (arrows === 'choose' && focused >= 0) buttons[shown]?.focus({ preventScroll: true });
  // the list of runs keeps the position to which the user has scrolled, until a new run is added
  if (arrows === 'choose' && buttons[shown]) reveal(box, buttons[shown]);
  else if (box.first !== tiles[0]?.value) box.scrollLeft = 0;
  box.first = tiles[0]?.value;
  box.onclick = (event) => {
    const k = buttons.indexOf(event.target.closest('button'));
    if (k >= 0 && !buttons[k].disabled) choose(k);
  };
  box.onkeydown = (event) => {
    const n = buttons.filter((button) => !button.disabled).length; // enabled tiles come first
    const now = buttons.indexOf(event.target.closest('button'));
    const next = { Home: 0, End: n - 1 }[event.key] ?? (now + ARROWS[event.key] + n) % n;
    if (!arrows || !(next >= 0)) return;
    event.preventDefault();
    if (arrows === 'choose') choose(next);
    else moveTo(shown, next);
  };
});

// Show a picture, or a part of a picture with several columns, and the texts of a tile.
function fill(button, { png = '', columns, width, height, name, title = '', mark = '', disabled, ...texts }, k) {
  const picture = button.querySelector('.picture');
  if (button.png !== png) picture.style.backgroundImage = png ? `url(data:image/png;base64,${png})` : 'none';
  button.png = png;
  picture.style.width = width && width + 'px';
  picture.style.aspectRatio = width && `${width} / ${height}`;
  if (columns) {
    picture.style.backgroundSize = `${columns * width}px auto`;
    picture.style.backgroundPosition = `${-(k % columns) * width}px ${-Math.floor(k / columns) * height}px`;
  }
  for (const part of ['badge', 'label', 'note']) button.querySelector(`.${part}`).textContent = texts[part] ?? '';
  Object.assign(button, { title, className: mark, disabled: Boolean(disabled) });
  button.setAttribute('aria-label', name);
}

// Scroll only the box, because scrollIntoView would move the page.
function reveal(box, { offsetTop: top, offsetHeight: high, offsetLeft: left, offsetWidth: wide }) {
  box.scrollTop = clamp(box.scrollTop, top + high - box.clientHeight + 3, top - 3);
  box.scrollLeft = clamp(box.scrollLeft, left + wide - box.clientWidth + 3, left - 3);
}
