// Pictures to pick one of; which one it was is known here only after the pick.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const quiz = parentElement.querySelector('.quiz');
  const { pictures, round, picked, answer } = data;
  const told = answer !== null && answer !== undefined;
  quiz.setAttribute('role', 'group');
  quiz.setAttribute('aria-label', 'Which one is the training image?');
  quiz.dataset.round = round;
  while (quiz.children.length > pictures.length) quiz.lastChild.remove();
  while (quiz.children.length < pictures.length) quiz.append(empty());
  [...quiz.children].forEach((button, k) => {
    const [picture, label] = button.children;
    const what = !told ? '' : k === answer ? 'training image' : 'realization';
    picture.style.backgroundImage = `url(data:image/png;base64,${pictures[k]})`;
    label.textContent = `${k + 1}${what ? ` · ${what}` : ''}${k === picked ? ', your pick' : ''}`;
    button.setAttribute('aria-label', `Picture ${label.textContent}`);
    button.disabled = told;
    button.classList.toggle('answer', told && k === answer);
    button.classList.toggle('picked', k === picked);
  });
  quiz.onclick = (event) => {
    const button = event.target.closest('button');
    if (button && !button.disabled) {
      setTriggerValue('chosen', { round, k: [...quiz.children].indexOf(button) });
    }
  };
});

function empty() {
  const button = document.createElement('button');
  button.type = 'button';
  const picture = document.createElement('div');
  picture.className = 'picture';
  button.append(picture, document.createElement('span'));
  return button;
}
