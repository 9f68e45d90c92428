// While a page is drawn anew, or works something out, its parts get no lower than they were: what is
// below them, and the reader's place in it, stay where they are.
const WORKING = '.working, .unseen';
const REST = 2000; // milliseconds after which what is drawn anew is all there, on a slow machine too

export default inOrder(({ data }) => {
  const app = document.querySelector('.stApp');
  const watched = new WeakSet();
  const heights = new Map(); // of each part by its name, the largest since it was at rest
  let timer = 0, changed = performance.now();
  const name = (part) => [...part.classList].find((one) => one.startsWith('st-key-'));
  const high = (part) => part.getBoundingClientRect().height;
  const keep = (part) => {
    const least = heights.get(name(part)) || 0;
    if (high(part) >= least) return heights.set(name(part), high(part));
    part.style.minHeight = least + 'px';
    return later();
  };
  const later = () => { timer ||= setTimeout(settle, REST); };
  const settle = () => {
    timer = 0;
    const resting = app.dataset.testScriptState === 'notRunning' && performance.now() - changed > REST;
    if (!resting) later(); // between two runs parts may be empty
    else document.querySelectorAll(data.parts).forEach((part) => {
      if (part.querySelector(WORKING)) return;
      part.style.minHeight = '';
      heights.set(name(part), high(part));
    });
  };
  const sizes = new ResizeObserver((news) => news.forEach(({ target }) => keep(target)));
  const changes = new MutationObserver((news) => {
    if (news.some(({ type }) => type === 'attributes')) changed = performance.now();
    const drawing = app.dataset.testScriptState !== 'notRunning' || performance.now() - changed < REST;
    document.querySelectorAll(data.parts).forEach((part) => {
      if (!watched.has(part)) sizes.observe(part); // which keeps it before it is painted
      else if (!drawing) return;
      watched.add(part);
      keep(part); // before anything can look at it
      later();
    });
  });
  changes.observe(app, { attributeFilter: ['data-test-script-state'], childList: true, subtree: true });
  return () => { sizes.disconnect(); changes.disconnect(); clearTimeout(timer); };
});
