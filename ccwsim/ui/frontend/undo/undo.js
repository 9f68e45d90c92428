// Ctrl+Z returns to the study before the last change, except while a text is being typed.
export default inOrder(({ setTriggerValue }) => {
  let typing = false;
  const typed = () => { typing = true; };
  const left = () => { typing = false; };
  const listen = (event) => {
    if (event.key === 'Enter') typing = false;
    const isUndo = event.key.toLowerCase() === 'z' && (event.ctrlKey || event.metaKey) && !event.shiftKey && !event.altKey;
    if (!isUndo || typing) return;
    event.preventDefault();
    setTriggerValue('undo', true);
  };
  const listeners = { input: typed, focusout: left, keydown: listen };
  for (const [name, does] of Object.entries(listeners)) document.addEventListener(name, does);
  return () => {
    for (const [name, does] of Object.entries(listeners)) document.removeEventListener(name, does);
  };
});
