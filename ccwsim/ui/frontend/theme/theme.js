// Redraws the page when the user switches between light and dark, because charts keep the colours of the
// theme in which they were drawn.
export default inOrder(({ data, parentElement, setTriggerValue }) => {
  const probe = parentElement.querySelector('i');
  let asked = data.theme;
  const look = () => {
    const app = document.querySelector('.stApp');
    const now = app && getComputedStyle(app).colorScheme === 'dark' ? 'dark' : 'light';
    // colours in CSS change at once; colours of charts change when the page is redrawn
    document.documentElement.style.colorScheme = now;
    if (now === asked) return;
    asked = now;
    setTriggerValue('theme', now);
  };
  probe.ontransitionend = look;
  look();
  return () => { if (probe.ontransitionend === look) probe.ontransitionend = null; };
});
