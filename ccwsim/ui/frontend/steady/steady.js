// While a page is being drawn, parts of the page keep their maximum height, so that elements below do not
// move.
const WORKING = '.working, .unseen';
const REST = 2000; // milliseconds without changes after which a page counts as complete

export default inOrder(({ data }) => {
  const app = document.querySelector('.stApp');
  const watched = new WeakSet();
  const heights = new Map(); // maximum height of each part since the page was complete, by name
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
    if (!resting) later(); // parts may be empty between two runs
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
      if (!watched.has(part)) sizes.observe(part); // the observer fixes the height before the part is painted
      else if (!drawing) return;
      watched.add(part);
      keep(part); // before other code reads the height
      later();
    });
  });
  changes.observe(app, { attributeFilter: ['data-test-script-state'], childList: true, subtree: true });
  return () => { sizes.disconnect(); changes.disconnect(); clearTimeout(timer); };
});
