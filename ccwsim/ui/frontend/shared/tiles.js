// Pictures in a box that act as buttons. This code precedes the modules of components with such pictures.
const ARROWS = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

// Put n buttons into a box, each with child elements of the given classes, and return the buttons.
function buttonsIn(box, label, n, ...parts) {
  box.setAttribute('role', 'group');
  box.setAttribute('aria-label', label);
  while (box.children.length > n) box.lastChild.remove();
  while (box.children.length < n) {
    const button = document.createElement('button');
    button.type = 'button';
    button.append(...parts.map((name) => element(name === 'picture' ? 'div' : 'span', name)));
    box.append(button);
  }
  return [...box.children];
}

function element(tag, name = '') {
  const part = document.createElement(tag);
  part.className = name;
  return part;
}

function show(part, png) { part.style.backgroundImage = png ? `url(data:image/png;base64,${png})` : 'none'; }

// Call `choose` with the index of the clicked button.
function onClick(box, choose) {
  box.onclick = (event) => {
    const button = event.target.closest('button');
    if (button && !button.disabled) choose([...box.children].indexOf(button));
  };
}

// Exactly one button is pressed. A click, or an arrow key among the first n buttons, presses another button.
function chooseOne(box, shown, n, tell) {
  const mark = (chosen) => [...box.children].forEach((button, k) => {
    button.setAttribute('aria-pressed', k === chosen);
    button.tabIndex = k === chosen ? 0 : -1;
  });
  const choose = (k) => {
    mark(k);
    box.children[k].focus({ preventScroll: true });
    tell(k);
  };
  mark(shown);
  onClick(box, choose);
  box.onkeydown = (event) => {
    const step = ARROWS[event.key];
    if (!step || !n) return;
    event.preventDefault();
    const now = [...box.children].findIndex((button) => button.getAttribute('aria-pressed') === 'true');
    choose((now + step + n) % n);
  };
}
