// Pictures from which the user picks one; the browser gets the answer only after the pick.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const quiz = parentElement.querySelector('.quiz');
  const { pictures, round, picked, answer } = data;
  const told = answer !== null && answer !== undefined;
  quiz.dataset.round = round;
  const title = 'Which one is the training image?';
  buttonsIn(quiz, title, pictures.length, 'picture', 'label').forEach((button, k) => {
    const [picture, label] = button.children;
    const what = !told ? '' : k === answer ? 'training image' : 'realization';
    show(picture, pictures[k]);
    label.textContent = `${k + 1}${what ? ` · ${what}` : ''}${k === picked ? ', your pick' : ''}`;
    button.setAttribute('aria-label', `Picture ${label.textContent}`);
    button.disabled = told;
    button.classList.toggle('answer', told && k === answer);
    button.classList.toggle('picked', k === picked);
  });
  onClick(quiz, (k) => setTriggerValue('chosen', { round, k }));
});
