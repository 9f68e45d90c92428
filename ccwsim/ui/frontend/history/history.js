// The runs of a session as buttons, newest first; arrow keys move, Enter or a click restores a run.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const strip = parentElement.querySelector('.history');
  const { runs, shown } = data;
  const title = 'Runs of this session, newest first; arrow keys move';
  const buttons = buttonsIn(strip, title, runs.length, 'picture', 'label', 'note');
  const focused = buttons.findIndex((button) => button.matches(':focus'));
  const reach = focused >= 0 ? focused : Math.max(shown, 0);
  buttons.forEach((button, k) => {
    const { png, width, height, label, note } = runs[k];
    const [box, name, below] = button.children;
    const picture = box.firstChild ?? box.appendChild(element('i'));
    picture.style.width = width + 'px';
    picture.style.height = height + 'px';
    if (button.png !== png) show(picture, button.png = png);
    name.textContent = label;
    below.textContent = note;
    button.title = label;
    button.setAttribute('aria-label', `Go back to the run: ${label}, ${note}`);
    button.setAttribute('aria-current', k === shown);
    button.tabIndex = k === reach ? 0 : -1;
  });
  const first = runs.length && runs[0].key;
  if (strip.newest !== first) strip.scrollLeft = 0;
  strip.newest = first;
  onClick(strip, (k) => setTriggerValue('chosen', runs[k].key));
  strip.onkeydown = (event) => {
    const now = buttons.indexOf(event.target.closest('button'));
    const next = { Home: 0, End: buttons.length - 1 }[event.key] ?? now + ARROWS[event.key];
    if (now < 0 || !buttons[next]) return;
    event.preventDefault();
    buttons.forEach((button, k) => { button.tabIndex = k === next ? 0 : -1; });
    buttons[next].focus();
  };
});
