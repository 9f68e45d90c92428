// A contact sheet: every realization as a button cut from one picture; arrow keys go on.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const sheet = parentElement.querySelector('.sheet');
  const { png, n, columns, width, height, shown } = data;
  sheet.setAttribute('role', 'group');
  sheet.setAttribute('aria-label', 'Realizations; arrow keys choose');
  const hadFocus = sheet.contains(parentElement.activeElement || document.activeElement);
  if (sheet.dataset.n !== String(n)) {
    sheet.replaceChildren(...Array.from({ length: n }, (_, r) => tile(r)));
    sheet.dataset.n = n;
  }
  sheet.classList.toggle('small', width < 64);
  [...sheet.children].forEach((button, r) => {
    button.style.width = width + 'px';
    button.style.height = height + 'px';
    button.style.backgroundImage = `url(data:image/png;base64,${png})`;
    button.style.backgroundSize = columns * width + 'px auto';
    button.style.backgroundPosition = `${-(r % columns) * width}px ${-Math.floor(r / columns) * height}px`;
  });
  const mark = (chosen) => [...sheet.children].forEach((button, r) => {
    button.setAttribute('aria-pressed', r === chosen);
    button.tabIndex = r === chosen ? 0 : -1;
  });
  const choose = (r) => {
    mark(r);
    sheet.children[r].focus({ preventScroll: true });
    setTriggerValue('chosen', r);
  };
  mark(shown);
  const large = sheet.children[shown];
  if (large) {  // scrolls the sheet alone: scrollIntoView would move the whole page
    const below = large.offsetTop + large.offsetHeight - sheet.clientHeight;
    sheet.scrollTop = Math.min(Math.max(sheet.scrollTop, below + 3), large.offsetTop - 3);
  }
  if (hadFocus && sheet.children[shown]) sheet.children[shown].focus({ preventScroll: true });
  sheet.onclick = (event) => {
    const button = event.target.closest('button');
    if (button) choose([...sheet.children].indexOf(button));
  };
  sheet.onkeydown = (event) => {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (!step) return;
    event.preventDefault();
    const now = [...sheet.children].findIndex((b) => b.getAttribute('aria-pressed') === 'true');
    choose((now + step + n) % n);
  };
});

function tile(r) {
  const button = document.createElement('button');
  button.type = 'button';
  button.setAttribute('aria-label', `Realization ${r + 1}`);
  const label = document.createElement('span');
  label.textContent = r + 1;
  button.append(label);
  return button;
}
