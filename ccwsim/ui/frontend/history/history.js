// The runs of a session, newest first: each a button; arrow keys move, Enter or a click goes back.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const strip = parentElement.querySelector('.history');
  const { runs, shown } = data;
  strip.setAttribute('role', 'group');
  strip.setAttribute('aria-label', 'Runs of this session, newest first; arrow keys move');
  while (strip.children.length > runs.length) strip.lastChild.remove();
  while (strip.children.length < runs.length) strip.append(empty());
  const buttons = [...strip.children];
  const focused = buttons.findIndex((button) => button.matches(':focus'));
  const reach = focused >= 0 ? focused : Math.max(shown, 0);
  buttons.forEach((button, k) => {
    const { png, width, height, label, note } = runs[k];
    const picture = button.firstChild.firstChild;
    picture.style.width = width + 'px';
    picture.style.height = height + 'px';
    const source = `url(data:image/png;base64,${png})`;
    if (button.source !== source) picture.style.backgroundImage = button.source = source;
    button.children[1].textContent = label;
    button.children[2].textContent = note;
    button.title = label;
    button.setAttribute('aria-label', `Go back to the run: ${label}, ${note}`);
    button.setAttribute('aria-current', k === shown);
    button.tabIndex = k === reach ? 0 : -1;
  });
  const first = runs.length && runs[0].key;
  if (strip.newest !== first) strip.scrollLeft = 0;
  strip.newest = first;
  strip.onclick = (event) => {
    const button = event.target.closest('button');
    if (button) setTriggerValue('chosen', runs[buttons.indexOf(button)].key);
  };
  strip.onkeydown = (event) => {
    const now = buttons.indexOf(event.target.closest('button'));
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    const next = event.key === 'Home' ? 0 : event.key === 'End' ? buttons.length - 1 : now + step;
    if (now < 0 || !buttons[next]) return;
    event.preventDefault();
    buttons.forEach((button, k) => { button.tabIndex = k === next ? 0 : -1; });
    buttons[next].focus();
  };
});

function empty() {
  const button = document.createElement('button');
  button.type = 'button';
  for (const name of ['picture', 'label', 'note']) {
    const part = document.createElement('span');
    part.className = name;
    button.append(part);
  }
  button.firstChild.append(document.createElement('i'));
  return button;
}
