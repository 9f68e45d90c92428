// Small maps of all realizations or images: each button shows a part of one picture; arrow keys change the choice.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const sheet = parentElement.querySelector('.sheet');
  const { png, n, columns, width, height, shown, label, names } = data;
  const hadFocus = sheet.contains(parentElement.activeElement || document.activeElement);
  sheet.classList.toggle('small', width < 64);
  sheet.classList.toggle('named', !!names);
  buttonsIn(sheet, label || 'Realizations; arrow keys choose', n, 'number').forEach((button, r) => {
    button.firstChild.textContent = names ? '' : r + 1;
    button.setAttribute('aria-label', names ? names[r] : `Realization ${r + 1}`);
    button.title = names ? names[r] : '';
    button.style.width = width + 'px';
    button.style.height = height + 'px';
    show(button, png);
    button.style.backgroundSize = columns * width + 'px auto';
    button.style.backgroundPosition = `${-(r % columns) * width}px ${-Math.floor(r / columns) * height}px`;
  });
  chooseOne(sheet, shown, n, (r) => setTriggerValue('chosen', r));
  const large = sheet.children[shown];
  if (!large) return;
  // scroll only the sheet, because scrollIntoView would move the page
  const below = large.offsetTop + large.offsetHeight - sheet.clientHeight;
  sheet.scrollTop = Math.min(Math.max(sheet.scrollTop, below + 3), large.offsetTop - 3);
  if (hadFocus) large.focus({ preventScroll: true });
});
