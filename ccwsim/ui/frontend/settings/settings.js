// Small multiples: a labelled picture per setting as a button; arrow keys change the choice.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const sheet = parentElement.querySelector('.settings');
  const { tiles, shown } = data;
  // on a phone a row has three pictures
  const share = Math.min(1, ((sheet.clientWidth || 1e4) - 36) / 3 / data.width);
  const [width, height] = share < 0.5 ? [data.width, data.height]
    : [Math.floor(data.width * share), Math.floor(data.height * share)];
  const title = 'Settings; arrow keys choose';
  buttonsIn(sheet, title, tiles.length, 'picture', 'label', 'note').forEach((button, k) => {
    const { png, label, note, recommended } = tiles[k];
    const [picture, name, below] = button.children;
    const star = picture.firstChild ?? picture.appendChild(element('span', 'star'));
    button.disabled = !png;
    button.style.width = Math.max(width, 96) + 'px';
    picture.style.width = width + 'px';
    picture.style.height = height + 'px';
    show(picture, png);
    star.textContent = recommended ? 'recommended' : '';
    star.hidden = !recommended;
    name.textContent = label;
    below.textContent = note;
    button.setAttribute('aria-label', `Setting ${label}`);
  });
  const ready = tiles.filter((tile) => tile.png).length;
  chooseOne(sheet, shown, ready, (k) => setTriggerValue('chosen', k));
});
