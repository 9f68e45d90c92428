// Left and right arrow keys step to the next or previous element, except in elements that use these keys.
const OWN = 'input, textarea, select, [role=slider], [role=listbox], [role=tab], [contenteditable]';

export default inOrder(({ setTriggerValue }) => {
  const listen = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
    if (event.composedPath().some((at) => at.matches && at.matches(OWN))) return;
    event.preventDefault();
    setTriggerValue('step', step);
  };
  document.addEventListener('keydown', listen);
  return () => document.removeEventListener('keydown', listen);
});
