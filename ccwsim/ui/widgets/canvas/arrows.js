// Left and right arrow keys step, wherever the focus is, but where they already mean something.
const OWN = 'input, textarea, select, [role=slider], [role=listbox], [role=tab], [contenteditable]';

export default function ({ parentElement, setTriggerValue }) {
  parentElement.stop?.(); // Streamlit calls again without an end of the call before
  const listen = (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
    if (event.composedPath().some((at) => at.matches && at.matches(OWN))) return;
    event.preventDefault();
    setTriggerValue('step', step);
  };
  document.addEventListener('keydown', listen);
  const stop = parentElement.stop = () => document.removeEventListener('keydown', listen);
  return stop;
}
